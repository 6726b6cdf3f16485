"""Common reach of two hands: the points that both can be moved to (proto/control.md, 5.10).

Each hand reaches a shell around its shoulder. All points and lengths are in one frame and one unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import NamedTuple

from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector

TOLERANCE = 1e-9
"""Distance by which a point may be outside a shell, for rounding."""


class Shell(NamedTuple):
    """Points at distances from `inner` to `outer` from `centre`."""

    centre: Vector
    inner: float
    outer: float

    def excesses(self, point: Vector) -> tuple[float, float]:
        """Return by how much a point is beyond the outer and within the inner sphere; negative for a distance left."""
        distance = vector.length(vector.subtract(point, self.centre))
        return distance - self.outer, self.inner - distance

    def contains(self, point: Vector) -> bool:
        """Return whether a point is in the shell, within `TOLERANCE`."""
        return max(self.excesses(point)) <= TOLERANCE

    def nearest(self, point: Vector) -> Vector:
        """Return the nearest point of the shell; straight down for the centre itself."""
        away = vector.subtract(point, self.centre)
        distance = vector.length(away)
        if self.inner <= distance <= self.outer:
            return point
        return self.at_distance(point, min(max(distance, self.inner), self.outer))

    def at_distance(self, point: Vector, distance: float) -> Vector:
        """Return the point in the direction of `point` at a distance from the centre."""
        direction = vector.unit(vector.subtract(point, self.centre), (0.0, -1.0, 0.0))
        return vector.add(self.centre, vector.scale(direction, distance))


def nearest_common_point(point: Vector, first: Shell, second: Shell) -> Vector | None:
    """Return the point of both shells that is nearest to `point`, None if they have no point in common.

    It is `point` itself, the nearest point of one of the four spheres, or that of a circle in which two of them meet.
    """
    if first.contains(point) and second.contains(point):
        return point
    nearest: Vector | None = None
    least = 0.0
    for candidate in _border_points(point, first, second):
        if first.contains(candidate) and second.contains(candidate):
            distance = vector.length(vector.subtract(candidate, point))
            if nearest is None or distance < least:
                nearest, least = candidate, distance
    return nearest


def _border_points(point: Vector, first: Shell, second: Shell) -> Iterator[Vector]:
    for shell in (first, second):
        for radius in (shell.outer, shell.inner):
            yield shell.at_distance(point, radius)
    between = vector.subtract(second.centre, first.centre)
    distance = vector.length(between)
    if distance < 1e-12:
        return
    axis = vector.scale(between, 1.0 / distance)
    for one in (first.outer, first.inner):
        for other in (second.outer, second.inner):
            along = (distance * distance + one * one - other * other) / (2.0 * distance)
            square = one * one - along * along
            if square < 0.0:
                continue
            middle = vector.add(first.centre, vector.scale(axis, along))
            off = vector.reject_from(vector.subtract(point, middle), axis)
            side = vector.unit(off, vector.any_perpendicular(axis))
            yield vector.add(middle, vector.scale(side, sqrt(square)))


class Gap(NamedTuple):
    """Distance of a point from a surface that it must not pass; negative beyond it."""

    distance: float
    normal: Vector
    """Unit vector to the surface."""
    retreat: float
    """Velocity of the surface along the normal."""


class ShellBorder(NamedTuple):
    """Both spheres of a shell that moves at the velocity `drift`."""

    shell: Shell
    drift: Vector

    def limit_speed(self, velocity: Vector, acceleration: float) -> Vector:
        """Return a velocity shortened so that `acceleration` suffices to follow the outer sphere at it."""
        relative = vector.subtract(velocity, self.drift)
        speed, most = vector.length(relative), sqrt(acceleration * self.shell.outer)
        return velocity if speed <= most else vector.add(self.drift, vector.scale(relative, most / speed))

    def gaps(self, point: Vector) -> list[Gap]:
        """Return the gaps to the outer and the inner sphere."""
        outward = vector.unit(vector.subtract(point, self.shell.centre), (0.0, -1.0, 0.0))
        inward = vector.scale(outward, -1.0)
        beyond, within = self.shell.excesses(point)
        return [
            Gap(-beyond, outward, vector.dot(self.drift, outward)),
            Gap(-within, inward, vector.dot(self.drift, inward)),
        ]


class CommonBorder(NamedTuple):
    """Border of the common reach of two shells that move at the velocities `drifts`.

    Where the outer spheres meet they form a sharp rim. A point that slides along one sphere would have to stop there at
    once, so the distance from the rim is a gap, too.
    """

    shells: tuple[Shell, Shell]
    drifts: tuple[Vector, Vector]

    def limit_speed(self, velocity: Vector, acceleration: float) -> Vector:
        """Return a velocity shortened for the first and then for the second shell."""
        for shell, drift in zip(self.shells, self.drifts, strict=True):
            velocity = ShellBorder(shell, drift).limit_speed(velocity, acceleration)
        return velocity

    def gaps(self, point: Vector) -> list[Gap]:
        """Return the gaps to the four spheres, and to the cylinder through the rim if that encloses the reach."""
        gaps = [gap for pair in zip(self.shells, self.drifts, strict=True) for gap in ShellBorder(*pair).gaps(point)]
        (first, second), (drift, second_drift) = self.shells, self.drifts
        between = vector.subtract(second.centre, first.centre)
        distance = vector.length(between)
        if distance < 1e-12:
            return gaps
        along = (distance * distance + first.outer * first.outer - second.outer * second.outer) / (2.0 * distance)
        square = first.outer * first.outer - along * along
        if not 0.0 < along < distance or square <= 0.0:
            return gaps
        axis, radius = vector.scale(between, 1.0 / distance), sqrt(square)
        away = vector.reject_from(vector.subtract(point, first.centre), axis)
        normal = vector.unit(away, vector.any_perpendicular(axis))
        apart = vector.subtract(second_drift, drift)
        centre_drift = vector.add(drift, vector.scale(apart, along / distance))
        growth = -along * (distance - along) / (distance * radius) * vector.dot(apart, axis)
        gaps.append(Gap(radius - vector.length(away), normal, vector.dot(centre_drift, normal) + growth))
        return gaps
