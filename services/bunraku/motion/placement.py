"""Placement of a performer on a stage: the whole motion rotated about y and moved."""

from __future__ import annotations

from math import cos, isfinite, sin
from typing import Any, NamedTuple, Self

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

MAX_STAGE_DISTANCE_M = 100.0
"""Bound of x and z, from the centre of the stage."""


class Placement(NamedTuple):
    """Rotation `turn` in radians about y, from z towards x, then translation `x` and `z` in metres, world frame."""

    x: float = 0.0
    z: float = 0.0
    turn: float = 0.0

    @classmethod
    def parse(cls, value: Any) -> Self:
        """Return the placement in a list `[x, z, turn]`; raise ValueError if it is invalid."""
        if not isinstance(value, list | tuple) or len(value) != 3:
            raise ValueError("a placement is [x, z, turn], three numbers")
        numbers = [float(number) if isinstance(number, int | float) else float("nan") for number in value]
        if not all(map(isfinite, numbers)):
            raise ValueError("a placement is [x, z, turn], three finite numbers")
        if max(abs(numbers[0]), abs(numbers[1])) > MAX_STAGE_DISTANCE_M:
            raise ValueError(f"x and z of a placement are within {MAX_STAGE_DISTANCE_M:g} metres")
        return cls(*numbers)

    def apply(self, root: Array, rotations: Array) -> tuple[Array, Array]:
        """Return root positions (..., 3) in metres and joint rotations (..., 18, 4) on the stage.

        Only the root's rotation changes.
        """
        if self == STAGE_CENTRE:
            return root, rotations
        turned = rotations.copy()
        turned[..., 0, :] = rotation.multiply(
            rotation.from_coordinate_axis(1, np.array(self.turn)), rotations[..., 0, :]
        )
        moved = root.copy()
        sine, cosine = sin(self.turn), cos(self.turn)
        moved[..., 0] = cosine * root[..., 0] + sine * root[..., 2] + self.x
        moved[..., 2] = cosine * root[..., 2] - sine * root[..., 0] + self.z
        return moved, turned


STAGE_CENTRE = Placement()
"""Centre of the stage, without rotation."""


def place_in_row(centres: list[Array], gaps: list[float], turns: list[float]) -> list[Placement]:
    """Return placements side by side along x, left to right as the audience sees them, centred.

    `centres` (2,) are x and z of the centre of each motion before its rotation, which is placed at z 0; `gaps` are the
    distances between neighbours in metres, one fewer.
    """
    placements, x_position = [], -sum(gaps) / 2
    for (x, z), turn, gap in zip(centres, turns, (*gaps, 0.0), strict=True):
        sine, cosine = sin(turn), cos(turn)
        placements.append(Placement(x_position - (cosine * x + sine * z), -(cosine * z - sine * x), turn))
        x_position += gap
    return placements
