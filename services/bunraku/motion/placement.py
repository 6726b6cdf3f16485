"""Where a performer dances on a stage: its whole dance turned about y and moved (SPEC.md, Track `motion`)."""

from __future__ import annotations

from math import cos, isfinite, sin
from typing import Any, NamedTuple, Self

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

MAX_STAGE_DISTANCE_M = 100.0
"""Metres that x and z may be from the middle of the stage."""


class Placement(NamedTuple):
    """`turn` radians about y, from z towards x, and then `x` and `z` metres, in the world's frame."""

    x: float = 0.0
    z: float = 0.0
    turn: float = 0.0

    @classmethod
    def parse(cls, value: Any) -> Self:
        """The place in a list `[x, z, turn]`; raises ValueError where it is none."""
        if not isinstance(value, list | tuple) or len(value) != 3:
            raise ValueError("a place is x, z and turn, three numbers")
        numbers = [float(number) if isinstance(number, int | float) else float("nan") for number in value]
        if not all(map(isfinite, numbers)):
            raise ValueError("a place is x, z and turn, three finite numbers")
        if max(abs(numbers[0]), abs(numbers[1])) > MAX_STAGE_DISTANCE_M:
            raise ValueError(f"x and z of a place are within {MAX_STAGE_DISTANCE_M:g} metres")
        return cls(*numbers)

    def apply(self, root: Array, rotations: Array) -> tuple[Array, Array]:
        """Root positions (..., 3), metres, and joint rotations (..., 18, 4), as they are on the stage. Only the root's
        rotation is another."""
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
"""In the middle of the stage, as it is told."""


def place_in_row(centres: list[Array], gaps: list[float], turns: list[float]) -> list[Placement]:
    """Places beside each other along x, from the left of who looks at them to the right, about the middle.

    `middles` (2,) are x and z of the middle of each dance before it is turned, which comes to stand at z 0; `apart` is
    how far each is from the next, metres: one fewer.
    """
    places, at = [], -sum(gaps) / 2
    for (x, z), turn, following in zip(centres, turns, (*gaps, 0.0), strict=True):
        sine, cosine = sin(turn), cos(turn)
        places.append(Placement(at - (cosine * x + sine * z), -(cosine * z - sine * x), turn))
        at += following
    return places
