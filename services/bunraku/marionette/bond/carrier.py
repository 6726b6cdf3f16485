"""Frame that carries a bonded pair: it moves with both shoulders, weighted (proto/control.md, 5.10).

Positions and velocities are in the world, in metres, unless stated otherwise.
"""

from __future__ import annotations

from typing import NamedTuple

from bunraku.marionette.bond.common_reach import CommonBorder, Shell
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import IDENTITY, Quaternion, Vector


class Shoulder(NamedTuple):
    """Shoulder of a bonded hand, and the reach of its arm."""

    position: Vector
    """Position of the shoulder joint."""
    rotation: Quaternion
    """Orientation of vl5, in whose axes the hand's positions are."""
    arm_length_m: float
    min_tip_distance: float
    """Smallest distance of the hand tip, arm lengths."""

    def to_world(self, place: Vector) -> Vector:
        """Return a place of the hand (arm lengths, the shoulder's frame) as a position."""
        return vector.add(self.position, vector.scale(vector.rotate(self.rotation, place), self.arm_length_m))

    def to_place(self, position: Vector) -> Vector:
        """Return a position as a place of the hand."""
        away = vector.rotate(vector.conjugate(self.rotation), vector.subtract(position, self.position))
        return vector.scale(away, 1.0 / self.arm_length_m)


class Carrier:
    """Movement of both shoulders in one frame, weighted: it carries the pair along."""

    def __init__(self, before: tuple[Shoulder, Shoulder], now: tuple[Shoulder, Shoulder], share: float) -> None:
        self._before, self._now = before, now
        self._weights = (share, 1.0 - share)
        self._turns = [
            vector.multiply(b.rotation, vector.conjugate(a.rotation)) for a, b in zip(before, now, strict=True)
        ]
        self.rotation = IDENTITY
        for turn, weight in zip(self._turns, self._weights, strict=True):
            shorter = turn if turn[0] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
            self.rotation = vector.multiply(self.rotation, vector.scale_rotation(shorter, weight))

    def move(self, point: Vector) -> Vector:
        """Return where a point at rest in the carried frame is now."""
        first, second = (vector.scale(self._follow(side, point), self._weights[side]) for side in (0, 1))
        return vector.add(first, second)

    def slip(self, side: int, point: Vector, seconds: float) -> Vector:
        """Return the velocity in the carried frame of a point at rest in one shoulder's frame, before this frame."""
        ahead = vector.scale(vector.subtract(self._follow(side, point), self.move(point)), 1.0 / seconds)
        return vector.rotate(vector.conjugate(self.rotation), ahead)

    def spread(self, point: Vector, seconds: float) -> Vector:
        """Return the velocity of a point at rest in the first shoulder's frame, seen from the second's."""
        return vector.scale(vector.subtract(self._follow(0, point), self._follow(1, point)), 1.0 / seconds)

    def drift(self, side: int, seconds: float) -> Vector:
        """Return the velocity of one shoulder in the carried frame."""
        moved = vector.subtract(self._now[side].position, self.move(self._before[side].position))
        return vector.scale(moved, 1.0 / seconds)

    def border(self, shells: tuple[Shell, Shell], seconds: float) -> CommonBorder:
        """Return the border of the common reach, as it moves in the carried frame."""
        return CommonBorder(shells, (self.drift(0, seconds), self.drift(1, seconds)))

    def _follow(self, side: int, point: Vector) -> Vector:
        """Return where a point at rest in one shoulder's frame is now."""
        away = vector.subtract(point, self._before[side].position)
        return vector.add(self._now[side].position, vector.rotate(self._turns[side], away))
