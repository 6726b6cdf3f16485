"""The links of an arm turn about themselves at a bounded speed.

Where a link lies says nothing about how far it is turned about itself. An arm that is all but straight may have any
plane, and an elbow in it turns that plane, and with it the whole upper arm about itself, with a movement that is hardly
seen; a wrist that bends a little more may turn the palm over. So each link remembers how it was turned, and what is
asked of it beyond `FASTEST` it makes up for later: shoulder, elbow and wrist trade that turn, and no place changes.
"""

from __future__ import annotations

from math import atan2, copysign, pi

from bunraku.marionette import vector
from bunraku.marionette.limb_rig import JointRotations
from bunraku.marionette.vector import Quaternion, Vector

MAX_TWIST_SPEED_RAD_S = 5.0 * pi
"""Radians per second that a link turns about itself at most."""
MAX_TWIST_LAG_RAD = 1.5 * pi
"""Radians that a link is behind at most; beyond, it takes the other way round."""
NO_TWIST_LAG = (0.0, 0.0, 0.0)

BoneDirections = tuple[Vector, Vector, Vector]
"""Of three links where their orientations are the identity, unit vectors."""


class TwistLimiter:
    """The three links of one arm, given where their orientations are the identity, of any length."""

    def __init__(self, bones: tuple[Vector, Vector, Vector]) -> None:
        first, second, third = (vector.unit(link, (0.0, -1.0, 0.0)) for link in bones)
        self._directions: BoneDirections = (first, second, third)
        self._orientations: JointRotations | None = None
        self.lag_rad: Vector = NO_TWIST_LAG
        """Radians, link by link, from what was wanted last to what was shown, within `FARTHEST` either way."""

    def limit(self, joints: JointRotations, share: float, seconds: float) -> JointRotations:
        """The joints nearest to `joints` that the arm is shown with, `seconds` after the last.

        All places are those of `joints`, and no link is turned about itself by more than `share` (0..1) of `FARTHEST`
        from them. The first time, and where all links keep up, these are `joints`.
        """
        if self._orientations is None:
            first, second, third = joints
            second = vector.multiply(first, second)
            self._orientations = (first, second, vector.multiply(second, third))
            return joints
        shown, self._orientations, self.lag_rad = limit_twist(
            self._directions, self._orientations, self.lag_rad, joints, share, seconds
        )
        return joints if self.lag_rad == NO_TWIST_LAG else shown


def limit_twist(
    directions: BoneDirections,
    orientations: JointRotations,
    lag_rad: Vector,
    joints: JointRotations,
    share: float,
    seconds: float,
) -> tuple[JointRotations, JointRotations, Vector]:
    """As `Spins.follow`: the joints, and what is remembered, the orientations of the links and how far each is behind.
    Compiled where `compiled` was loaded."""
    most, step = MAX_TWIST_LAG_RAD * share, MAX_TWIST_SPEED_RAD_S * seconds
    first, second = joints[0], vector.multiply(joints[0], joints[1])
    third = vector.multiply(second, joints[2])
    first, one = _limit_bone_twist(directions[0], orientations[0], lag_rad[0], first, most, step)
    second, two = _limit_bone_twist(directions[1], orientations[1], lag_rad[1], second, most, step)
    third, three = _limit_bone_twist(directions[2], orientations[2], lag_rad[2], third, most, step)
    elbow = vector.normalise(vector.multiply(vector.conjugate(first), second))
    wrist = vector.normalise(vector.multiply(vector.conjugate(second), third))
    return (first, elbow, wrist), (first, second, third), (one, two, three)


def _limit_bone_twist(
    direction: Vector, orientation: Quaternion, lag_rad: float, target: Quaternion, max_lag: float, max_step: float
) -> tuple[Quaternion, float]:
    """The orientation of a link that was `shown` turned by `behind` from what was wanted then, and is `wanted` now; and
    by how much it is turned from that, `most` at most, `step` radians less than if it had not turned about itself."""
    along = vector.rotate(target, direction)
    carried = vector.multiply(vector.rotation_between(vector.rotate(orientation, direction), along), orientation)
    w, x, y, z = vector.multiply(carried, vector.conjugate(target))
    angle = 2.0 * atan2(vector.dot((x, y, z), along), w)
    # the way round that it took, unless that is much the longer by now
    angle += 2.0 * pi * round((lag_rad - angle) / (2.0 * pi))
    if abs(angle) > MAX_TWIST_LAG_RAD:
        angle -= 2.0 * pi * round(angle / (2.0 * pi))
    left = min(max(abs(angle) - max_step, 0.0), max_lag)
    angle = copysign(left, angle) if left > 0.0 else 0.0
    return vector.normalise(vector.multiply(vector.from_axis_angle(along, angle), target)), angle
