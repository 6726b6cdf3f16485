"""The links of an arm turn about themselves at a bounded speed.

Where a link lies says nothing about how far it is turned about itself. An arm that is all but straight may have any
plane, and an elbow in it turns that plane, and with it the whole upper arm about itself, with a movement that is hardly
seen; a wrist that bends a little more may turn the palm over. So each link remembers how it was turned, and what is
asked of it beyond `FASTEST` it makes up for later: shoulder, elbow and wrist trade that turn, and no place changes.
"""

from __future__ import annotations

from math import atan2, copysign, pi

from bunraku.marionette import vector
from bunraku.marionette.limbs import Joints
from bunraku.marionette.vector import Quaternion, Vector

FASTEST = 5.0 * pi
"""Radians per second that a link turns about itself at most."""
FARTHEST = 1.5 * pi
"""Radians that a link is behind at most; beyond, it takes the other way round."""
AT_REST = (0.0, 0.0, 0.0)

Directions = tuple[Vector, Vector, Vector]
"""Of three links where their orientations are the identity, unit vectors."""


class Spins:
    """The three links of one arm, given where their orientations are the identity, of any length."""

    def __init__(self, links: tuple[Vector, Vector, Vector]) -> None:
        first, second, third = (vector.unit(link, (0.0, -1.0, 0.0)) for link in links)
        self._directions: Directions = (first, second, third)
        self._shown: Joints | None = None
        self.behind: Vector = AT_REST
        """Radians, link by link, from what was wanted last to what was shown, within `FARTHEST` either way."""

    def follow(self, joints: Joints, share: float, seconds: float) -> Joints:
        """The joints nearest to `joints` that the arm is shown with, `seconds` after the last.

        All places are those of `joints`, and no link is turned about itself by more than `share` (0..1) of `FARTHEST`
        from them. The first time, and where all links keep up, these are `joints`.
        """
        if self._shown is None:
            first, second, third = joints
            second = vector.multiply(first, second)
            self._shown = (first, second, vector.multiply(second, third))
            return joints
        shown, self._shown, self.behind = turn(self._directions, self._shown, self.behind, joints, share, seconds)
        return joints if self.behind == AT_REST else shown


def turn(
    directions: Directions, shown: Joints, behind: Vector, joints: Joints, share: float, seconds: float
) -> tuple[Joints, Joints, Vector]:
    """As `Spins.follow`: the joints, and what is remembered, the orientations of the links and how far each is behind.
    Compiled where `compiled` was loaded."""
    most, step = FARTHEST * share, FASTEST * seconds
    first, second = joints[0], vector.multiply(joints[0], joints[1])
    third = vector.multiply(second, joints[2])
    first, one = _link(directions[0], shown[0], behind[0], first, most, step)
    second, two = _link(directions[1], shown[1], behind[1], second, most, step)
    third, three = _link(directions[2], shown[2], behind[2], third, most, step)
    elbow = vector.normalise(vector.multiply(vector.conjugate(first), second))
    wrist = vector.normalise(vector.multiply(vector.conjugate(second), third))
    return (first, elbow, wrist), (first, second, third), (one, two, three)


def _link(
    direction: Vector, shown: Quaternion, behind: float, wanted: Quaternion, most: float, step: float
) -> tuple[Quaternion, float]:
    """The orientation of a link that was `shown` turned by `behind` from what was wanted then, and is `wanted` now; and
    by how much it is turned from that, `most` at most, `step` radians less than if it had not turned about itself."""
    along = vector.rotate(wanted, direction)
    carried = vector.multiply(vector.between(vector.rotate(shown, direction), along), shown)
    w, x, y, z = vector.multiply(carried, vector.conjugate(wanted))
    angle = 2.0 * atan2(vector.dot((x, y, z), along), w)
    # the way round that it took, unless that is much the longer by now
    angle += 2.0 * pi * round((behind - angle) / (2.0 * pi))
    if abs(angle) > FARTHEST:
        angle -= 2.0 * pi * round(angle / (2.0 * pi))
    left = min(max(abs(angle) - step, 0.0), most)
    angle = copysign(left, angle) if left > 0.0 else 0.0
    return vector.normalise(vector.multiply(vector.about(along, angle), wanted)), angle
