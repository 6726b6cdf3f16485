"""A limb on its way to where it is wanted, at a bounded acceleration.

Whatever the target does, the limb speeds up, brakes in time and arrives without running past: each step takes the
greatest speed from which it can still stop (the time-optimal way of a mass with a bounded force, in discrete time; Han,
From PID to Active Disturbance Rejection Control, IEEE Trans. Ind. Electronics 2009, has it as a tracking
differentiator). A target that moves evenly is kept up with and not run after.
"""

from __future__ import annotations

from math import inf, sqrt

from bunraku.marionette import vector
from bunraku.marionette.vector import Vector

MAX_TARGET_SPEED = 4.0
"""Arm lengths (radians, of a thigh) per second: a target that moved faster has jumped, and has no speed of its own."""
MAX_LIMB_SPEED = 5.0
"""Arm lengths (radians) per second: no hand or thigh is sent farther in a second than that."""
SHOULDER_CLEARANCE = 0.35
"""Arm lengths from the shoulder within which a hand on its way elsewhere does not come: it goes round."""

ZERO_VELOCITY: Vector = (0.0, 0.0, 0.0)


class Follower:
    """One hand (arm lengths) or thigh (radians in the first of three), where it is and how fast it goes."""

    def __init__(self, position: Vector, velocity: Vector = ZERO_VELOCITY) -> None:
        self.position = position
        self.velocity = velocity
        self._previous_target: Vector | None = None
        self._previous_frame_velocity: Vector | None = None

    def step(
        self,
        target: Vector,
        seconds: float,
        acceleration: float,
        min_distance: float = 0.0,
        max_distance: float = inf,
        frame_velocity: Vector | None = None,
    ) -> Vector:
        """The place `seconds` later, on the way to `wanted`.

        `acceleration` (a second squared) bounds the change of velocity. With `carried`, the velocity of a moving ground
        (the dance's own limb), the bound is on the change against it: so the limb is back in the dance in a time that
        does not depend on what the dance does. A place nearer to the origin than `inner` or farther than `outer` is not
        taken, and the way round the origin keeps `CLEARANCE` where it can.
        """
        if seconds <= 0.0:
            return self.position
        if frame_velocity is not None:
            ahead, before = frame_velocity, self._previous_frame_velocity or frame_velocity
        else:
            moved = vector.scale(vector.subtract(target, self._previous_target or target), 1.0 / seconds)
            ahead = moved if vector.length(moved) <= MAX_TARGET_SPEED else ZERO_VELOCITY
            before = ZERO_VELOCITY
        self._previous_target, self._previous_frame_velocity = target, frame_velocity
        # with a moving ground all velocities are against it
        ground = ahead if frame_velocity is not None else ZERO_VELOCITY
        self.position, self.velocity = advance(
            self.position,
            self.velocity,
            target,
            ahead,
            before,
            ground,
            seconds,
            acceleration,
            min_distance,
            max_distance,
        )
        return self.position


def advance(
    position: Vector,
    velocity: Vector,
    target: Vector,
    target_velocity: Vector,
    previous_frame_velocity: Vector,
    frame_velocity: Vector,
    seconds: float,
    acceleration: float,
    min_distance: float,
    max_distance: float,
) -> tuple[Vector, Vector]:
    """Place and velocity `seconds` later, on the way to `wanted`, which itself goes `ahead` at that velocity.

    The velocity of the ground that one goes on is `ground`, and was `before`; the rest as `Follower.step` has it.
    """
    # what is left of the way when the target's own is taken off
    direction, distance = _path_to(
        position, vector.subtract(target, vector.scale(target_velocity, seconds)), min_distance
    )
    most = acceleration * seconds
    # the speed from which whole steps of the bounded acceleration come to rest after `distance`
    speed = most * (sqrt(0.25 + 2.0 * distance / (most * seconds)) - 0.5)
    speed = min(speed, distance / seconds, MAX_LIMB_SPEED)
    aim = vector.subtract(vector.add(target_velocity, vector.scale(direction, speed)), frame_velocity)
    had = vector.subtract(velocity, previous_frame_velocity)
    change = vector.subtract(aim, had)
    size = vector.length(change)
    if size > most:
        change = vector.scale(change, most / size)
    velocity = vector.add(vector.add(had, change), frame_velocity)
    after = _clamp_distance(vector.add(position, vector.scale(velocity, seconds)), min_distance, max_distance)
    return after, vector.scale(vector.subtract(after, position), 1.0 / seconds)


def _path_to(position: Vector, target: Vector, min_distance: float) -> tuple[Vector, float]:
    """The unit vector to set out on, and how far it is: straight, or past a point beside the origin."""
    straight = vector.subtract(target, position)
    distance = vector.length(straight)
    if distance < 1e-12:
        return ZERO_VELOCITY, 0.0
    direction = vector.scale(straight, 1.0 / distance)
    if min_distance <= 0.0:
        return direction, distance
    along = -vector.dot(position, direction)
    near = min(SHOULDER_CLEARANCE, vector.length(position), vector.length(target))
    if not 0.0 < along < distance:
        return direction, distance
    nearest = vector.add(position, vector.scale(direction, along))
    off = vector.length(nearest)
    if off >= near:
        return direction, distance
    # in front of the chest, where a hand that comes straight across has the room
    aside = vector.unit(nearest, (0.0, 0.0, 1.0)) if off > 1e-3 else _detour_direction(direction)
    past = vector.scale(aside, near)
    first = vector.subtract(past, position)
    leg = vector.length(first)
    if leg < 1e-9:
        return direction, distance
    rest = vector.length(vector.subtract(target, past))
    return vector.scale(first, 1.0 / leg), leg + rest


def _detour_direction(direction: Vector) -> Vector:
    ahead = vector.reject_from((0.0, 0.0, 1.0), direction)
    return (
        vector.unit(ahead, vector.any_perpendicular(direction))
        if vector.length(ahead) > 0.1
        else vector.any_perpendicular(direction)
    )


def _clamp_distance(position: Vector, min_distance: float, max_distance: float) -> Vector:
    size = vector.length(position)
    if size < min_distance:
        return vector.scale(vector.unit(position, (0.0, -1.0, 0.0)), min_distance)
    return vector.scale(position, max_distance / size) if size > max_distance else position
