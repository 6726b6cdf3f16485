"""One time step of a limb on its way to a target, at a bounded acceleration.

The limb accelerates, brakes in time and arrives without overshoot, whatever the target does: each step takes the
largest speed from which the limb can still stop. This is the time-optimal control of a mass with a bounded force in
discrete time (Han, From PID to Active Disturbance Rejection Control, IEEE Trans. Ind. Electronics 2009, as a tracking
differentiator). A target at constant velocity is tracked without lag.

Plain functions of plain numbers, so that `_kernels` can compile them.
"""

from __future__ import annotations

from math import sqrt

from bunraku.marionette.constants import MAX_LIMB_SPEED, SHOULDER_CLEARANCE
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import ZERO, Vector


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
    """Return position and velocity `seconds` later, on the way to a `target` that moves at `target_velocity`.

    `frame_velocity` is the velocity of the frame of reference, `previous_frame_velocity` that of the step before. The
    other parameters are those of `Follower.step`.
    """
    # the remaining path without the part that the target itself will move
    direction, distance = path_to(
        position, vector.subtract(target, vector.scale(target_velocity, seconds)), min_distance
    )
    max_change = acceleration * seconds
    # the speed from which steps at full deceleration stop after `distance`
    speed = max_change * (sqrt(0.25 + 2.0 * distance / (max_change * seconds)) - 0.5)
    speed = min(speed, distance / seconds, MAX_LIMB_SPEED)
    goal_velocity = vector.subtract(vector.add(target_velocity, vector.scale(direction, speed)), frame_velocity)
    relative = vector.subtract(velocity, previous_frame_velocity)
    change = vector.subtract(goal_velocity, relative)
    size = vector.length(change)
    if size > max_change:
        change = vector.scale(change, max_change / size)
    velocity = vector.add(vector.add(relative, change), frame_velocity)
    after = _clamp_distance(vector.add(position, vector.scale(velocity, seconds)), min_distance, max_distance)
    return after, vector.scale(vector.subtract(after, position), 1.0 / seconds)


def path_to(position: Vector, target: Vector, min_distance: float) -> tuple[Vector, float]:
    """Return the initial unit direction and the length of the path: straight, or past a point beside the origin."""
    straight = vector.subtract(target, position)
    distance = vector.length(straight)
    if distance < 1e-12:
        return ZERO, 0.0
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
    # in front of the chest, where a hand that crosses straight has room
    beside = vector.unit(nearest, (0.0, 0.0, 1.0)) if off > 1e-3 else _detour_direction(direction)
    past = vector.scale(beside, near)
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
