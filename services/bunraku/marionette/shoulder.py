"""How far a shoulder lets the upper arm go: a few round holes in the sphere of its directions.

A hand in space leaves an arm free to turn about the line from shoulder to tip, and to bend the wrist more or less. So
where gravity would put the upper arm into a direction that no shoulder has, it is turned about that line as little as
brings it out, then the wrist is bent otherwise, and only where no bend helps is the hand brought nearer, its direction
kept. (Reach cones: Wilhelms and Van Gelder, Fast and Easy Reach-Cone Joint Limits, 2001; here their complement, as
caps, which makes every answer closed.)

Directions are unit vectors on the axes of vl5: x to the left, y up, z forwards.
"""

from __future__ import annotations

from math import acos, atan2, cos, inf, nan, pi, radians, sin, sqrt

from bunraku.marionette import vector
from bunraku.marionette.vector import Vector

_EDGE_MARGIN_RAD = 1e-9


ExclusionCap = tuple[Vector, float]
"""A unit vector, and within how many radians of it no upper arm goes."""
ExclusionCaps = tuple[ExclusionCap, ...]
ShoulderLimit = tuple[ExclusionCaps, tuple[Vector, ...]]
"""One shoulder's limit: its caps, and the corners where the edges of two meet and no third one lies. A plain tuple, as
those are handed to compiled code in no time."""


def _make_cap(side: float, up: float, forwards: float, degrees: float) -> ExclusionCap:
    return vector.unit((side, up, forwards), (0.0, 0.0, -1.0)), radians(degrees)


LEFT_CAPS: ExclusionCaps = (
    # straight back: extension ends at 60 degrees, horizontal abduction 45 to 50 behind the side
    _make_cap(0.0, 0.2, -1.0, 42.0),
    # up and back: flexion and abduction end overhead, at 180 degrees
    _make_cap(0.0, 0.75, -0.85, 47.0),
    # across the back: no farther than the arm's own side
    _make_cap(-1.0, -0.1, -0.75, 46.0),
    # across the chest: horizontal adduction ends at 130 to 140 degrees from the side
    _make_cap(-1.0, 0.15, -0.05, 42.0),
)
"""Where no left upper arm goes. Ranges: American Academy of Orthopaedic Surgeons, Joint Motion (1965), rounded out."""


def make_shoulder_limit(*, right: bool) -> ShoulderLimit:
    """The left shoulder, or its mirror image."""
    side = -1.0 if right else 1.0
    caps = tuple(((side * axis[0], axis[1], axis[2]), radius) for axis, radius in LEFT_CAPS)
    alone: ShoulderLimit = (caps, ())
    pairs = ((one, other) for i, one in enumerate(caps) for other in caps[i + 1 :])
    corners = tuple(
        corner
        for one, other in pairs
        for corner in _cap_corners(one, other)
        if depth_in_caps(alone, corner) <= _EDGE_MARGIN_RAD
    )
    return caps, corners


def depth_in_caps(limit: ShoulderLimit, direction: Vector) -> float:
    """How far a unit vector is inside a cap, radians; not above zero where a shoulder goes."""
    caps, _ = limit
    deepest = -inf
    for cap in caps:
        deepest = max(deepest, _depth_in_cap(cap, direction))
    return deepest


def angle_to_allowed(limit: ShoulderLimit, direction: Vector) -> float:
    """The angle from a unit vector to the nearest direction that a shoulder has, radians."""
    if depth_in_caps(limit, direction) <= 0.0:
        return 0.0
    caps, corners = limit
    nearest = inf
    for axis, radius in caps:
        across = vector.unit(vector.reject_from(direction, axis), vector.any_perpendicular(axis))
        edge = vector.add(vector.scale(axis, cos(radius)), vector.scale(across, sin(radius)))
        if depth_in_caps(limit, edge) <= _EDGE_MARGIN_RAD:
            nearest = min(nearest, _angle_between(edge, direction))
    for corner in corners:
        nearest = min(nearest, _angle_between(corner, direction))
    return nearest


def step_toward(limit: ShoulderLimit, begin: Vector, end: Vector, max_angle: float) -> Vector:
    """The unit vector `most` radians from `begin` on a way to `end` round the caps; `end` where it is nearer."""
    if _angle_between(begin, end) <= max_angle:
        return end
    caps, _ = limit
    step = vector.rotate(
        vector.from_axis_angle(vector.unit(vector.cross(begin, end), vector.any_perpendicular(begin)), max_angle), begin
    )
    for cap in caps:
        if _depth_in_cap(cap, step) > 0.0 and _depth_in_cap(cap, begin) <= 0.0:
            # along the edge, to the side that leads on
            axis, radius = cap
            out = vector.unit(vector.reject_from(step, axis), vector.any_perpendicular(axis))
            edge = radius + _EDGE_MARGIN_RAD
            step = vector.add(vector.scale(axis, cos(edge)), vector.scale(out, sin(edge)))
    # in a corner of two caps it stays where it is
    return step if depth_in_caps(limit, step) <= max(depth_in_caps(limit, begin), 0.0) else begin


def min_allowed_turn(limit: ShoulderLimit, chord: Vector, normal: Vector, lift: float) -> float:
    """The least turn about the unit `chord` from shoulder to tip, radians, that brings the upper arm where a shoulder
    goes; NaN where none does.

    The upper arm is `lift` radians off the chord, below it in the plane of the unit `normal` (square to the chord).
    """
    caps, _ = limit
    down = vector.cross(chord, normal)
    closed = False
    for cap in caps:
        middle, half = _blocked_turns(cap, chord, normal, down, lift)
        if half >= pi:
            return nan
        closed = closed or abs(middle) < half
    if not closed:
        return 0.0
    least = nan
    for cap in caps:
        middle, half = _blocked_turns(cap, chord, normal, down, lift)
        if half <= 0.0:
            continue
        for way in (middle - half - _EDGE_MARGIN_RAD, middle + half + _EDGE_MARGIN_RAD):
            to = _wrap_angle(way)
            if abs(to) >= abs(least):
                continue
            free = True
            for other in caps:
                middle_there, half_there = _blocked_turns(other, chord, normal, down, lift)
                free = free and abs(_wrap_angle(to - middle_there)) >= half_there
            if free:
                least = to
    return least


def _blocked_turns(cap: ExclusionCap, chord: Vector, normal: Vector, down: Vector, lift: float) -> tuple[float, float]:
    """The turns about the chord that bring the upper arm into a cap: the middle of them, and half of how many there
    are: 0 for none, more than pi for all."""
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
    """Where the edges of two caps cross: none, or two unit vectors."""
    (axis, radius), (other_axis, other_radius) = one, other
    d = vector.dot(axis, other_axis)
    square = 1.0 - d * d
    if square < _EDGE_MARGIN_RAD:
        return []
    a = (cos(radius) - d * cos(other_radius)) / square
    b = (cos(other_radius) - d * cos(radius)) / square
    middle = vector.add(vector.scale(axis, a), vector.scale(other_axis, b))
    left = 1.0 - vector.dot(middle, middle)
    if left <= 0.0:
        return []
    across = vector.scale(vector.cross(axis, other_axis), (left / square) ** 0.5)
    return [vector.add(middle, across), vector.subtract(middle, across)]
