"""Between the dance and a puppeteer's hand: what keeps a limb from jumping when it is taken and let go.

The *place* of the limb goes over at a bounded acceleration (`follow`), then the limb is solved. Over the same time the
joints are brought from the dance's way of reaching a place to the marionette's (`blend`), by the weight given here.
"""

from __future__ import annotations

from math import atan2, pi, sqrt

from bunraku.marionette import vector
from bunraku.marionette.limb_rig import JointRotations
from bunraku.marionette.vector import Quaternion, Vector

BLEND_IN_S = 0.150
"""Seconds from the dance's way of holding a limb to the marionette's."""
BLEND_OUT_S = 0.350
"""Seconds from the marionette's way to the dance's."""
HAND_ACCELERATION = 79.0
"""Arm lengths per second squared: a quarter of an arm is crossed in 0.11 s."""
THIGH_ACCELERATION = 60.0
"""Radians per second squared."""
RETURN_DURATION_S = 0.280
"""Seconds in which a limb let go comes back to the dance, where the acceleration that it takes is within the bounds."""
MIN_RETURN_ACCELERATION = 6.0
MIN_HALF_ANGLE_COSINE = -0.7
"""Cosine of half the angle (of 270 degrees) that a joint goes round at most where the other way is shorter by now."""


def return_acceleration(distance: float, speed: float, max_acceleration: float) -> float:
    """What brings a limb back in `RETURN` that is `distance` away and goes away at `speed`, by braking, speeding up and
    braking again; within `LEAST_ACCELERATION` and `most`."""
    low, high = MIN_RETURN_ACCELERATION, max_acceleration
    for _ in range(20):
        middle = 0.5 * (low + high)
        turned = distance + speed * speed / (2.0 * middle)
        late = speed / middle + 2.0 * sqrt(turned / middle) > RETURN_DURATION_S
        low, high = (middle, high) if late else (low, middle)
    return high


def minimum_jerk(x: float) -> float:
    """0 to 1 for x from 0 to 1, with no speed and no acceleration at either end (Flash and Hogan 1985)."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


class Handover:
    """How far a limb is in its puppeteer's hands: `progress` 0 (the dance's) to 1, even in time."""

    def __init__(self) -> None:
        self.progress = 0.0

    @property
    def weight(self) -> float:
        """Of the marionette's way of holding the limb, 0..1."""
        return minimum_jerk(self.progress)

    def advance(self, is_held: bool, seconds: float) -> None:
        """`seconds` later, with the limb held or not."""
        step = seconds / BLEND_IN_S if is_held else -seconds / BLEND_OUT_S
        self.progress = min(max(self.progress + step, 0.0), 1.0)


class DirectionAlignment:
    """The turn that brings the direction of the dance's hand to that of the pulled one, on a way round the shoulder.

    It is carried on from call to call, so that two hands that pass opposite each other do not make it change sides.
    """

    def __init__(self) -> None:
        self._rotation: Quaternion | None = None

    def update(self, motion_target: Vector, controlled_target: Vector, weight: float) -> Quaternion:
        """The turn from the direction of `dance` to that of `pulled`.

        What it turns about the arm itself, having gone round, is at most half a circle times `weight`: so it is the
        shortest turn when the hand is back. All the way there, at `weight` 1, it starts afresh from the shortest.
        """
        down = (0.0, -1.0, 0.0)
        here, there = vector.unit(motion_target, down), vector.unit(controlled_target, down)
        shortest = vector.rotation_between(here, there)
        turn = shortest
        if self._rotation is not None:
            turn = vector.multiply(vector.rotation_between(vector.rotate(self._rotation, here), there), self._rotation)
            w, x, y, z = vector.multiply(turn, vector.conjugate(shortest))
            twist = 2.0 * atan2(vector.dot((x, y, z), there), w)
            twist -= 2.0 * pi * round(twist / (2.0 * pi))
            most = pi * weight
            if abs(twist) > most:
                turn = vector.multiply(vector.from_axis_angle(there, min(max(twist, -most), most)), shortest)
        self._rotation = None if weight >= 1.0 else vector.normalise(turn)
        return turn


class JointBlend:
    """The joints of a limb between the dance's and the marionette's.

    Each turns on the way that it took first, as long as that is not much the longer: by the shortest way it would be
    thrown across when the two come to be opposite each other.
    """

    def __init__(self) -> None:
        self._previous_rotations: list[Quaternion | None] = [None, None, None]

    def blend(self, motion_joints: JointRotations, solved_joints: JointRotations, weight: float) -> JointRotations:
        """The joints at `weight`; exactly either at 0 and 1, and all the way there it starts afresh."""
        if weight >= 1.0:
            self._previous_rotations = [None, None, None]
            return solved_joints
        a, b, c = (self._blend_joint(joint, motion_joints[joint], solved_joints[joint], weight) for joint in range(3))
        return motion_joints if weight <= 0.0 else (a, b, c)

    def _blend_joint(
        self, joint: int, motion_rotation: Quaternion, solved_rotation: Quaternion, weight: float
    ) -> Quaternion:
        w, x, y, z = vector.multiply(vector.conjugate(motion_rotation), solved_rotation)
        before = self._previous_rotations[joint]
        onwards = w if before is None else before[0] * w + before[1] * x + before[2] * y + before[3] * z
        sign = -1.0 if onwards < 0.0 else 1.0
        if sign * w < MIN_HALF_ANGLE_COSINE:
            sign = -sign
        self._previous_rotations[joint] = way = (sign * w, sign * x, sign * y, sign * z)
        return vector.normalise(vector.multiply(motion_rotation, vector.scale_rotation(way, weight)))
