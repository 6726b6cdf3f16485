"""Steering of a point at a bounded acceleration, so that it never passes a border (proto/control.md, 5.10).

Velocities are those in the frame that carries the point, `max_change` is the change of velocity in one step.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

from bunraku.marionette.bond.common_reach import TOLERANCE, CommonBorder, Gap, ShellBorder
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector

WALL_ROUNDS = 4
"""Rounds in which the limits of several surfaces are applied in turn."""


class Wall(NamedTuple):
    """Limit of a velocity: its component along the unit `normal` is at most `speed`."""

    normal: Vector
    speed: float


def steer(
    start: Vector,
    before: Vector,
    aim: Vector,
    border: ShellBorder | CommonBorder,
    max_change: float,
    seconds: float,
    max_free_change: float = inf,
) -> Vector:
    """Return the velocity with which a point at `start` nears the velocity `aim`, changed by at most `max_change`.

    What the border demands comes first; the rest of the change, up to `max_free_change` in all, goes to the aim.
    """
    free_change = min(max_change, max_free_change)
    walls = [wall_before(gap, 0.5 * max_change, seconds) for gap in border.gaps(start)]
    # the other half of the change is for the curvature of the border
    aim = border.limit_speed(aim, 0.5 * max_change / seconds)
    velocity = before
    for _ in range(WALL_ROUNDS):
        forced = limit_change(before, keep_within(before, walls), max_change)
        velocity = _spend_change(before, forced, keep_within(aim, walls), free_change)
        # a border is curved: a point that moves along it leaves it
        gaps = border.gaps(vector.add(start, vector.scale(velocity, seconds)))
        if min(gap.distance for gap in gaps) >= -TOLERANCE:
            break
        walls = [
            wall._replace(speed=wall.speed + min(gap.distance, 0.0) / seconds)
            for wall, gap in zip(walls, gaps, strict=True)
        ]
    return velocity


def wall_before(gap: Gap, max_change: float, seconds: float) -> Wall:
    """Return the limit with which a point can stop before a surface that moves."""
    before = gap.distance - gap.retreat * seconds
    speed = braking_speed(before, max_change, seconds) if before > 0.0 else before / seconds
    return Wall(gap.normal, gap.retreat + speed)


def braking_speed(distance: float, max_change: float, seconds: float) -> float:
    """Return the largest speed from which steps of `max_change` stop after `distance`."""
    speed = max_change * (sqrt(0.25 + 2.0 * distance / (max_change * seconds)) - 0.5)
    return min(speed, distance / seconds)


def keep_within(velocity: Vector, walls: list[Wall]) -> Vector:
    """Return a velocity within all limits that is near to `velocity`."""
    for _ in range(WALL_ROUNDS):
        for wall in walls:
            excess = vector.dot(velocity, wall.normal) - wall.speed
            if excess > 0.0:
                velocity = vector.subtract(velocity, vector.scale(wall.normal, excess))
    return velocity


def limit_change(before: Vector, after: Vector, max_change: float) -> Vector:
    """Return the velocity nearest to `after` within `max_change` of `before`, on the way there."""
    change = vector.subtract(after, before)
    size = vector.length(change)
    return after if size <= max_change else vector.add(before, vector.scale(change, max_change / size))


def _spend_change(before: Vector, forced: Vector, aim: Vector, max_change: float) -> Vector:
    """Return the velocity farthest on the way from `forced` to `aim` within `max_change` of `before`, or `forced`."""
    path, base = vector.subtract(aim, forced), vector.subtract(forced, before)
    a, b = vector.dot(path, path), vector.dot(path, base)
    c = vector.dot(base, base) - max_change * max_change
    if a + 2.0 * b + c <= 0.0:
        return aim
    # `forced` is often at `max_change` itself: the way leads into the sphere or away from it, whatever c is rounded to
    square = b * b - a * c
    if a <= 0.0 or square < 0.0 or (c >= 0.0 and b >= 0.0):
        return forced
    return vector.add(forced, vector.scale(path, (sqrt(square) - b) / a))
