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

JUMP = 4.0
"""Arm lengths (radians, of a thigh) per second: a target that moved faster has jumped, and has no speed of its own."""
FASTEST = 5.0
"""Arm lengths (radians) per second: no hand or thigh is sent farther in a second than that."""
CLEARANCE = 0.35
"""Arm lengths from the shoulder within which a hand on its way elsewhere does not come: it goes round."""

STILL: Vector = (0.0, 0.0, 0.0)


class Follower:
    """One hand (arm lengths) or thigh (radians in the first of three), where it is and how fast it goes."""

    def __init__(self, place: Vector, velocity: Vector = STILL) -> None:
        self.place = place
        self.velocity = velocity
        self._wanted: Vector | None = None
        self._carried: Vector | None = None

    def step(
        self,
        wanted: Vector,
        seconds: float,
        acceleration: float,
        inner: float = 0.0,
        outer: float = inf,
        carried: Vector | None = None,
    ) -> Vector:
        """The place `seconds` later, on the way to `wanted`.

        `acceleration` (a second squared) bounds the change of velocity. With `carried`, the velocity of a moving ground
        (the dance's own limb), the bound is on the change against it: so the limb is back in the dance in a time that
        does not depend on what the dance does. A place nearer to the origin than `inner` or farther than `outer` is not
        taken, and the way round the origin keeps `CLEARANCE` where it can.
        """
        if seconds <= 0.0:
            return self.place
        if carried is not None:
            ahead, before = carried, self._carried or carried
        else:
            moved = vector.scale(vector.subtract(wanted, self._wanted or wanted), 1.0 / seconds)
            ahead = moved if vector.length(moved) <= JUMP else STILL
            before = STILL
        self._wanted, self._carried = wanted, carried
        # with a moving ground all velocities are against it
        ground = ahead if carried is not None else STILL
        self.place, self.velocity = advance(
            self.place, self.velocity, wanted, ahead, before, ground, seconds, acceleration, inner, outer
        )
        return self.place


def advance(
    place: Vector,
    velocity: Vector,
    wanted: Vector,
    ahead: Vector,
    before: Vector,
    ground: Vector,
    seconds: float,
    acceleration: float,
    inner: float,
    outer: float,
) -> tuple[Vector, Vector]:
    """Place and velocity `seconds` later, on the way to `wanted`, which itself goes `ahead` at that velocity.

    The velocity of the ground that one goes on is `ground`, and was `before`; the rest as `Follower.step` has it.
    """
    # what is left of the way when the target's own is taken off
    direction, distance = _way(place, vector.subtract(wanted, vector.scale(ahead, seconds)), inner)
    most = acceleration * seconds
    # the speed from which whole steps of the bounded acceleration come to rest after `distance`
    speed = most * (sqrt(0.25 + 2.0 * distance / (most * seconds)) - 0.5)
    speed = min(speed, distance / seconds, FASTEST)
    aim = vector.subtract(vector.add(ahead, vector.scale(direction, speed)), ground)
    had = vector.subtract(velocity, before)
    change = vector.subtract(aim, had)
    size = vector.length(change)
    if size > most:
        change = vector.scale(change, most / size)
    velocity = vector.add(vector.add(had, change), ground)
    after = _within(vector.add(place, vector.scale(velocity, seconds)), inner, outer)
    return after, vector.scale(vector.subtract(after, place), 1.0 / seconds)


def _way(place: Vector, wanted: Vector, inner: float) -> tuple[Vector, float]:
    """The unit vector to set out on, and how far it is: straight, or past a point beside the origin."""
    straight = vector.subtract(wanted, place)
    distance = vector.length(straight)
    if distance < 1e-12:
        return STILL, 0.0
    direction = vector.scale(straight, 1.0 / distance)
    if inner <= 0.0:
        return direction, distance
    along = -vector.dot(place, direction)
    near = min(CLEARANCE, vector.length(place), vector.length(wanted))
    if not 0.0 < along < distance:
        return direction, distance
    nearest = vector.add(place, vector.scale(direction, along))
    off = vector.length(nearest)
    if off >= near:
        return direction, distance
    # in front of the chest, where a hand that comes straight across has the room
    aside = vector.unit(nearest, (0.0, 0.0, 1.0)) if off > 1e-3 else _aside(direction)
    past = vector.scale(aside, near)
    first = vector.subtract(past, place)
    leg = vector.length(first)
    if leg < 1e-9:
        return direction, distance
    rest = vector.length(vector.subtract(wanted, past))
    return vector.scale(first, 1.0 / leg), leg + rest


def _aside(direction: Vector) -> Vector:
    ahead = vector.square_to((0.0, 0.0, 1.0), direction)
    return vector.unit(ahead, vector.across(direction)) if vector.length(ahead) > 0.1 else vector.across(direction)


def _within(place: Vector, inner: float, outer: float) -> Vector:
    size = vector.length(place)
    if size < inner:
        return vector.scale(vector.unit(place, (0.0, -1.0, 0.0)), inner)
    return vector.scale(place, outer / size) if size > outer else place
