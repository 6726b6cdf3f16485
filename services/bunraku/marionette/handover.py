"""Hand-over between the stored motion and a puppeteer, so that a limb never jumps.

The *target* of the limb moves at a bounded acceleration (`follower`), then the limb is solved. At the same time the
joints are blended from the motion's to the solver's (`blend`), with the weight computed here.
"""

from __future__ import annotations

from math import atan2, pi, sqrt

from bunraku.marionette.constants import (
    BLEND_IN_S,
    BLEND_OUT_S,
    MIN_HALF_ANGLE_COSINE,
    MIN_RETURN_ACCELERATION,
    RETURN_DURATION_S,
)
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import JointRotations, Quaternion, Vector


def return_acceleration(distance: float, speed: float, max_acceleration: float) -> float:
    """Return the acceleration that brings a limb back in `RETURN_DURATION_S`.

    The limb is `distance` away and moves away at `speed`; it brakes, accelerates and brakes again. The result is within
    `MIN_RETURN_ACCELERATION` and `max_acceleration`.
    """
    low, high = MIN_RETURN_ACCELERATION, max_acceleration
    for _ in range(20):
        middle = 0.5 * (low + high)
        turning_distance = distance + speed * speed / (2.0 * middle)
        is_late = speed / middle + 2.0 * sqrt(turning_distance / middle) > RETURN_DURATION_S
        low, high = (middle, high) if is_late else (low, middle)
    return high


def minimum_jerk(x: float) -> float:
    """Ease x from 0 to 1 with zero speed and zero acceleration at both ends (Flash and Hogan 1985)."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


class Handover:
    """Progress of a hand-over: 0 (stored motion) to 1 (puppeteer), linear in time."""

    def __init__(self) -> None:
        self.progress = 0.0

    @property
    def weight(self) -> float:
        """Weight of the solver's joints, 0..1."""
        return minimum_jerk(self.progress)

    def advance(self, is_held: bool, seconds: float) -> None:
        """Advance by `seconds`, in the direction that depends on whether the limb is held."""
        step = seconds / BLEND_IN_S if is_held else -seconds / BLEND_OUT_S
        self.progress = min(max(self.progress + step, 0.0), 1.0)


class DirectionAlignment:
    """Rotation from the direction of the motion's hand to that of the controlled hand.

    It has a state, so that it does not change sides when the two directions pass opposite each other.
    """

    def __init__(self) -> None:
        self._rotation: Quaternion | None = None

    def update(self, motion_target: Vector, controlled_target: Vector, weight: float) -> Quaternion:
        """Return the rotation from the direction of `motion_target` to that of `controlled_target`.

        Its twist about the arm, relative to the shortest rotation, is at most half a turn times `weight`, so that it is
        the shortest rotation once the hand is back. At `weight` 1 the state is reset.
        """
        down = (0.0, -1.0, 0.0)
        motion_direction, controlled_direction = vector.unit(motion_target, down), vector.unit(controlled_target, down)
        shortest = vector.rotation_between(motion_direction, controlled_direction)
        turn = shortest
        if self._rotation is not None:
            turn = vector.multiply(
                vector.rotation_between(vector.rotate(self._rotation, motion_direction), controlled_direction),
                self._rotation,
            )
            w, x, y, z = vector.multiply(turn, vector.conjugate(shortest))
            twist = 2.0 * atan2(vector.dot((x, y, z), controlled_direction), w)
            twist -= 2.0 * pi * round(twist / (2.0 * pi))
            max_twist = pi * weight
            if abs(twist) > max_twist:
                turn = vector.multiply(
                    vector.from_axis_angle(controlled_direction, min(max(twist, -max_twist), max_twist)), shortest
                )
        self._rotation = None if weight >= 1.0 else vector.normalise(turn)
        return turn


class JointBlend:
    """Blend of a limb's joints between the motion and the solver.

    Each joint keeps its way round unless it becomes much longer: with the shortest way, a joint would be thrown across
    when the two rotations become opposite.
    """

    def __init__(self) -> None:
        self._previous_rotations: list[Quaternion | None] = [None, None, None]

    def blend(self, motion_joints: JointRotations, solved_joints: JointRotations, weight: float) -> JointRotations:
        """Return the joints at `weight`: exactly the motion's at 0 and the solver's at 1, which resets the state."""
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
        continued = w if before is None else before[0] * w + before[1] * x + before[2] * y + before[3] * z
        sign = -1.0 if continued < 0.0 else 1.0
        if sign * w < MIN_HALF_ANGLE_COSINE:
            sign = -sign
        self._previous_rotations[joint] = rotation = (sign * w, sign * x, sign * y, sign * z)
        return vector.normalise(vector.multiply(motion_rotation, vector.scale_rotation(rotation, weight)))
