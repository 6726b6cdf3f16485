"""The plane an arm hangs in, with memory.

Gravity alone would put the arm in the vertical plane through shoulder and hand tip. Straight above and below the
shoulder that plane is undefined, and a hand that passes there would throw the elbow across. So the plane is carried
along with the hand by the shortest turn, and swings about the line from shoulder to tip towards the vertical one, the
faster the farther the hand is from the axis. The tip lies in the plane at every instant, so it stays exact.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin

from bunraku.marionette import vector
from bunraku.marionette.vector import Vector

NEAR_AXIS = 0.05
"""Distance from the vertical axis, in arm lengths, at which the plane is drawn half as fast as far away."""
HALF_LIFE = 0.080
"""Seconds in which the swing left to do halves, far from the axis."""
FASTEST = 2.0 * pi
"""Radians per second that the plane swings at most."""


def vertical_normal(direction: Vector, up: Vector) -> Vector | None:
    """Normal of the vertical plane through the unit `direction`; None within 1e-9 of the axis.

    Turning about it by a positive angle raises the outer end: it is the axis of the elbow's bend.
    """
    normal = vector.cross(direction, up)
    size = vector.length(normal)
    return vector.scale(normal, 1.0 / size) if size > 1e-9 else None


class Plane:
    """One arm's plane, in the shoulder's frame so that a turning body carries it. `normal` is a unit vector."""

    def __init__(self, normal: Vector, direction: Vector) -> None:
        """Starts square to the unit `direction` of the hand tip, as near to `normal` as that allows."""
        square = vector.square_to(normal, direction)
        self.normal = vector.unit(square, vector.across(direction))
        self._direction = direction

    def follow(self, direction: Vector, reach: float, up: Vector, seconds: float) -> Vector:
        """The normal once the tip has come to the unit `direction` at `reach` arm lengths, `seconds` after the last.

        `up` is the world's up, a unit vector in the same frame.
        """
        turned = vector.rotate(vector.between(self._direction, direction), self.normal)
        normal = vector.unit(vector.square_to(turned, direction), vector.across(direction))
        self._direction = direction
        wanted = vertical_normal(direction, up)
        if wanted is not None:
            off = vector.length(vector.square_to(direction, up)) * reach
            pull = off * off / (off * off + NEAR_AXIS * NEAR_AXIS)
            swing = atan2(vector.dot(vector.cross(normal, wanted), direction), vector.dot(normal, wanted))
            turn = swing * (1.0 - 2.0 ** (-seconds * pull / HALF_LIFE))
            turn = min(max(turn, -FASTEST * seconds), FASTEST * seconds)
            side = vector.cross(direction, normal)
            normal = vector.add(vector.scale(normal, cos(turn)), vector.scale(side, sin(turn)))
        self.normal = normal
        return normal
