"""How far a shoulder lets the upper arm go: a few round holes in the sphere of its directions.

A hand in space leaves an arm free to turn about the line from shoulder to tip, and to bend the wrist more or less. So
where gravity would put the upper arm into a direction that no shoulder has, it is turned about that line as little as
brings it out, then the wrist is bent otherwise, and only where no bend helps is the hand brought nearer, its direction
kept. (Reach cones: Wilhelms and Van Gelder, Fast and Easy Reach-Cone Joint Limits, 2001; here their complement, as
caps, which makes every answer closed.)

Directions are unit vectors on the axes of vl5: x to the left, y up, z forwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, radians, sin

from bunraku.marionette import vector
from bunraku.marionette.vector import Vector

_EDGE = 1e-9


@dataclass(frozen=True, slots=True)
class Cap:
    """Directions within `radius` radians of the unit vector `axis`, where no upper arm goes."""

    axis: Vector
    radius: float

    def depth(self, direction: Vector) -> float:
        """How far inside a unit vector is, radians; below zero outside."""
        return self.radius - _angle(self.axis, direction)


def _cap(side: float, up: float, forwards: float, degrees: float) -> Cap:
    return Cap(vector.unit((side, up, forwards), (0.0, 0.0, -1.0)), radians(degrees))


LEFT = (
    # straight back: extension ends at 60 degrees, horizontal abduction 45 to 50 behind the side
    _cap(0.0, 0.2, -1.0, 42.0),
    # up and back: flexion and abduction end overhead, at 180 degrees
    _cap(0.0, 0.75, -0.85, 47.0),
    # across the back: no farther than the arm's own side
    _cap(-1.0, -0.1, -0.75, 46.0),
    # across the chest: horizontal adduction ends at 130 to 140 degrees from the side
    _cap(-1.0, 0.15, -0.05, 42.0),
)
"""Where no left upper arm goes. Ranges: American Academy of Orthopaedic Surgeons, Joint Motion (1965), rounded out."""


class Shoulder:
    """One shoulder's limit. `limit` says where the elbow goes."""

    def __init__(self, *, right: bool, caps: tuple[Cap, ...] = LEFT) -> None:
        """`caps` are the left shoulder's; the right one's mirror them."""
        side = -1.0 if right else 1.0
        self.caps = tuple(Cap((side * cap.axis[0], cap.axis[1], cap.axis[2]), cap.radius) for cap in caps)
        self._corners = tuple(
            corner
            for i, one in enumerate(self.caps)
            for other in self.caps[i + 1 :]
            for corner in _corners(one, other)
            if self.depth(corner) <= _EDGE
        )

    def depth(self, direction: Vector) -> float:
        """How far a unit vector is inside a cap, radians; not above zero where a shoulder goes."""
        return max(cap.depth(direction) for cap in self.caps)

    def away(self, direction: Vector) -> float:
        """The angle from a unit vector to the nearest direction that a shoulder has, radians."""
        if self.depth(direction) <= 0.0:
            return 0.0
        edges = []
        for cap in self.caps:
            across = vector.unit(vector.square_to(direction, cap.axis), vector.across(cap.axis))
            edges.append(vector.add(vector.scale(cap.axis, cos(cap.radius)), vector.scale(across, sin(cap.radius))))
        return min(_angle(edge, direction) for edge in (*edges, *self._corners) if self.depth(edge) <= _EDGE)

    def toward(self, begin: Vector, end: Vector, most: float) -> Vector:
        """The unit vector `most` radians from `begin` on a way to `end` round the caps; `end` where it is nearer."""
        angle = _angle(begin, end)
        if angle <= most:
            return end
        axis = vector.unit(vector.cross(begin, end), vector.across(begin))
        step = vector.rotate(vector.about(axis, most), begin)
        for cap in self.caps:
            if cap.depth(step) > 0.0 and cap.depth(begin) <= 0.0:
                # along the edge, to the side that leads on
                out = vector.unit(vector.square_to(step, cap.axis), vector.across(cap.axis))
                edge = cap.radius + _EDGE
                step = vector.add(vector.scale(cap.axis, cos(edge)), vector.scale(out, sin(edge)))
        # in a corner of two caps it stays where it is
        return step if self.depth(step) <= max(self.depth(begin), 0.0) else begin

    def turn(self, chord: Vector, normal: Vector, lift: float) -> float | None:
        """The least turn about the unit `chord` from shoulder to tip, radians, that brings the upper arm where a
        shoulder goes; None where none does.

        The upper arm is `lift` radians off the chord, below it in the plane of the unit `normal` (square to the chord).
        """
        along, off = cos(lift), sin(lift)
        down = vector.cross(chord, normal)
        closed: list[tuple[float, float]] = []
        for cap in self.caps:
            a, b = vector.dot(cap.axis, down), -vector.dot(cap.axis, normal)
            swing = off * hypot(a, b)
            over = cos(cap.radius) - along * vector.dot(cap.axis, chord)
            if over >= swing:
                continue
            if over <= -swing:
                return None
            closed.append((atan2(b, a), acos(over / swing)))
        if all(abs(_wrapped(middle)) >= half for middle, half in closed):
            return 0.0
        turns = (_wrapped(middle + sign * (half + _EDGE)) for middle, half in closed for sign in (-1.0, 1.0))
        allowed = [t for t in turns if all(abs(_wrapped(t - middle)) >= half for middle, half in closed)]
        return min(allowed, key=abs, default=None)


def _angle(a: Vector, b: Vector) -> float:
    return atan2(vector.length(vector.cross(a, b)), vector.dot(a, b))


def _wrapped(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi


def _corners(one: Cap, other: Cap) -> list[Vector]:
    """Where the edges of two caps cross: none, or two unit vectors."""
    d = vector.dot(one.axis, other.axis)
    square = 1.0 - d * d
    if square < _EDGE:
        return []
    a = (cos(one.radius) - d * cos(other.radius)) / square
    b = (cos(other.radius) - d * cos(one.radius)) / square
    middle = vector.add(vector.scale(one.axis, a), vector.scale(other.axis, b))
    left = 1.0 - vector.dot(middle, middle)
    if left <= 0.0:
        return []
    across = vector.scale(vector.cross(one.axis, other.axis), (left / square) ** 0.5)
    return [vector.add(middle, across), vector.subtract(middle, across)]
