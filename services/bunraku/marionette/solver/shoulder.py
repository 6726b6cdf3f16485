"""Limit of the shoulder: a few spherical caps of directions that the upper arm cannot take.

With the hand tip given, an arm is free to turn about the chord, the segment from shoulder to tip, and to bend the
wrist. If gravity would put the upper arm into a cap, the arm turns about the chord by the smallest angle that leads
out. If no turn helps, the wrist bends differently; if no bend helps, the hand is brought nearer in its direction.
(Reach cones: Wilhelms and Van Gelder, Fast and Easy Reach-Cone Joint Limits, 2001; caps are their complement, for
which every answer has a closed form.)

Directions are unit vectors on the axes of vl5: x to the left, y up, z forwards.
"""

from __future__ import annotations

from math import acos, atan2, cos, inf, nan, pi, sin, sqrt

from bunraku.marionette.constants import CAP_EDGE_MARGIN_RAD, LEFT_SHOULDER_CAPS
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector

ExclusionCap = tuple[Vector, float]
"""Unit axis and radius in radians of a cap of excluded directions."""
ExclusionCaps = tuple[ExclusionCap, ...]
ShoulderLimit = tuple[ExclusionCaps, tuple[Vector, ...]]
"""Caps of one shoulder, and the corners where the edges of two caps meet outside all others.

A plain tuple: passing one to compiled code costs almost nothing.
"""


LEFT_CAPS: ExclusionCaps = tuple((vector.unit(axis, (0.0, 0.0, -1.0)), radius) for axis, radius in LEFT_SHOULDER_CAPS)
"""Excluded directions of the left upper arm."""


def make_shoulder_limit(*, right: bool) -> ShoulderLimit:
    """Return the limit of the left shoulder, or its mirror image."""
    side = -1.0 if right else 1.0
    caps = tuple(((side * axis[0], axis[1], axis[2]), radius) for axis, radius in LEFT_CAPS)
    caps_only: ShoulderLimit = (caps, ())
    pairs = ((one, other) for i, one in enumerate(caps) for other in caps[i + 1 :])
    corners = tuple(
        corner
        for one, other in pairs
        for corner in _cap_corners(one, other)
        if depth_in_caps(caps_only, corner) <= CAP_EDGE_MARGIN_RAD
    )
    return caps, corners


def depth_in_caps(limit: ShoulderLimit, direction: Vector) -> float:
    """Return the largest depth of a unit vector inside a cap, radians; at most zero for an allowed direction."""
    caps, _ = limit
    deepest = -inf
    for cap in caps:
        deepest = max(deepest, _depth_in_cap(cap, direction))
    return deepest


def angle_to_allowed(limit: ShoulderLimit, direction: Vector) -> float:
    """Return the angle from a unit vector to the nearest allowed direction, radians."""
    if depth_in_caps(limit, direction) <= 0.0:
        return 0.0
    caps, corners = limit
    nearest = inf
    for axis, radius in caps:
        across = vector.unit(vector.reject_from(direction, axis), vector.any_perpendicular(axis))
        edge = vector.add(vector.scale(axis, cos(radius)), vector.scale(across, sin(radius)))
        if depth_in_caps(limit, edge) <= CAP_EDGE_MARGIN_RAD:
            nearest = min(nearest, _angle_between(edge, direction))
    for corner in corners:
        nearest = min(nearest, _angle_between(corner, direction))
    return nearest


def step_toward(limit: ShoulderLimit, begin: Vector, end: Vector, max_angle: float) -> Vector:
    """Return the unit vector `max_angle` radians from `begin` on a path to `end` round the caps; `end` if nearer."""
    if _angle_between(begin, end) <= max_angle:
        return end
    caps, _ = limit
    step = vector.rotate(
        vector.from_axis_angle(vector.unit(vector.cross(begin, end), vector.any_perpendicular(begin)), max_angle), begin
    )
    for cap in caps:
        if _depth_in_cap(cap, step) > 0.0 and _depth_in_cap(cap, begin) <= 0.0:
            # along the edge, on the side that leads on
            axis, radius = cap
            out = vector.unit(vector.reject_from(step, axis), vector.any_perpendicular(axis))
            edge = radius + CAP_EDGE_MARGIN_RAD
            step = vector.add(vector.scale(axis, cos(edge)), vector.scale(out, sin(edge)))
    # stay in a corner of two caps
    return step if depth_in_caps(limit, step) <= max(depth_in_caps(limit, begin), 0.0) else begin


def min_allowed_turn(limit: ShoulderLimit, chord: Vector, normal: Vector, lift: float) -> float:
    """Return the smallest turn about the unit `chord` that gives the upper arm an allowed direction; NaN for none.

    The upper arm is `lift` radians below the chord in the plane of the unit `normal`, which is perpendicular to the
    chord. Angles are in radians.
    """
    caps, _ = limit
    down = vector.cross(chord, normal)
    is_blocked = False
    for cap in caps:
        middle, half = _blocked_turns(cap, chord, normal, down, lift)
        if half >= pi:
            return nan
        is_blocked = is_blocked or abs(middle) < half
    if not is_blocked:
        return 0.0
    least = nan
    for cap in caps:
        middle, half = _blocked_turns(cap, chord, normal, down, lift)
        if half <= 0.0:
            continue
        for edge in (middle - half - CAP_EDGE_MARGIN_RAD, middle + half + CAP_EDGE_MARGIN_RAD):
            to = _wrap_angle(edge)
            if abs(to) >= abs(least):
                continue
            free = True
            for other in caps:
                other_middle, other_half = _blocked_turns(other, chord, normal, down, lift)
                free = free and abs(_wrap_angle(to - other_middle)) >= other_half
            if free:
                least = to
    return least


def _blocked_turns(cap: ExclusionCap, chord: Vector, normal: Vector, down: Vector, lift: float) -> tuple[float, float]:
    """Return middle and half width of the interval of turns about the chord that put the upper arm into a cap.

    The half width is 0 if no turn does, more than pi if every turn does.
    """
    axis, radius = cap
    a, b = vector.dot(axis, down), -vector.dot(axis, normal)
    swing = sin(lift) * sqrt(a * a + b * b)
    over = cos(radius) - cos(lift) * vector.dot(axis, chord)
    if over >= swing:
        return 0.0, 0.0
    if over <= -swing:
        return 0.0, 2.0 * pi
    return atan2(b, a), acos(over / swing)


def _depth_in_cap(cap: ExclusionCap, direction: Vector) -> float:
    axis, radius = cap
    return radius - _angle_between(axis, direction)


def _angle_between(a: Vector, b: Vector) -> float:
    return atan2(vector.length(vector.cross(a, b)), vector.dot(a, b))


def _wrap_angle(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi


def _cap_corners(one: ExclusionCap, other: ExclusionCap) -> list[Vector]:
    """Return the two unit vectors where the edges of two caps cross, or none."""
    (axis, radius), (other_axis, other_radius) = one, other
    d = vector.dot(axis, other_axis)
    square = 1.0 - d * d
    if square < CAP_EDGE_MARGIN_RAD:
        return []
    a = (cos(radius) - d * cos(other_radius)) / square
    b = (cos(other_radius) - d * cos(radius)) / square
    middle = vector.add(vector.scale(axis, a), vector.scale(other_axis, b))
    left = 1.0 - vector.dot(middle, middle)
    if left <= 0.0:
        return []
    across = vector.scale(vector.cross(axis, other_axis), (left / square) ** 0.5)
    return [vector.add(middle, across), vector.subtract(middle, across)]
