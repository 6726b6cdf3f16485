"""Size of a prop, where it is gripped, and how it lies (proto/playback.md, 4.12)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.props.surface import Triangles

MIN_LENGTH_M, MAX_LENGTH_M = 0.02, 4.0
"""Lengths of props that are taken for metres, as glTF has them, and within which a given one must be."""
_UNITS = (("centimetres", 0.01), ("millimetres", 0.001), ("inches", 0.0254))
_USUAL_LENGTHS_M = (0.05, 2.0)
"""Lengths of props in another unit by which that is recognised."""
_SMALLEST_SIZE = 1e-9
_DEFAULT_LENGTH_M = 0.4
"""Length of a prop whose unit is unknown."""
_ORIGIN_TOLERANCE = 0.05
"""Largest distance of a prop's origin from its box if the prop is held there, as a share of its length."""
_LYING_SLENDERNESS = 2.0
"""Height by width from which a prop does not stand, but lies."""
_SLAB_M = 0.04
"""Half the width of a hand: the parts of a prop within it are held."""
_MAX_SHAFT_RADIUS_M = 0.035
"""Radius up to which a hand closes around a shaft; a thicker prop lies in the palm."""
_PALM_GAP_M = 0.01
_MAX_PALM_OFFSET_M = 0.5


class Grip(StrEnum):
    """Point at which a prop is held."""

    ORIGIN = "origin"
    MIDDLE = "middle"
    BOTTOM = "bottom"


class Placing(NamedTuple):
    """Positions (n, 3) of a prop in metres from its grip, and the guesses about them."""

    positions: Array
    guessed: list[str]


@dataclass(frozen=True, slots=True)
class PropForm:
    """Rest of a prop on the floor, and its place in a hand; the frame is that of the prop."""

    pitch: float
    """Turn about x on the floor, in radians: 0 if it stands."""
    height: float
    """Height of the grip above the floor, in metres."""
    palm_offset: float
    """Distance of what lies in the palm from the grip, in metres; 0 for a shaft that goes through the hand."""


def place_prop(positions: Array, length: float | None = None, grip: Grip | None = None) -> Placing:
    """Return the positions (n, 3) of a scene as those of a prop of this `length`, in metres, held at `grip`.

    Without a length, units other than metres are recognised; without a grip, the origin is taken if it is near.
    """
    guessed: list[str] = []
    low, high = positions.min(axis=0), positions.max(axis=0)
    size = float((high - low).max())
    scale = _guess_scale(size, guessed) if length is None else length / max(size, _SMALLEST_SIZE)
    if grip is None:
        grip = Grip.ORIGIN
        if not ((low <= _ORIGIN_TOLERANCE * size) & (high >= -_ORIGIN_TOLERANCE * size)).all():
            grip = Grip.MIDDLE
            guessed.append("Its origin is outside of it: it is held at its middle.")
    middle = (low + high) / 2.0
    if grip is Grip.BOTTOM:
        middle[1] = low[1]
    placed: Array = (positions - (0.0 if grip is Grip.ORIGIN else middle)) * scale
    return Placing(placed, guessed)


def find_form(positions: Array, triangles: Triangles) -> PropForm:
    """Return the form of a prop from its positions, in metres from the grip."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    width = max(high[0] - low[0], high[2] - low[2])
    lies = high[1] - low[1] > _LYING_SLENDERNESS * width
    pitch, height = (math.pi / 2, high[2]) if lies else (0.0, -low[1])
    inside = _find_in_hand(positions, triangles)
    palm_offset = 0.0
    if len(inside) and np.abs(inside[:, [0, 2]]).max() > _MAX_SHAFT_RADIUS_M:
        palm_offset = min(float(np.abs(inside[:, 2]).max()) + _PALM_GAP_M, _MAX_PALM_OFFSET_M)
    return PropForm(pitch, float(height) + 0.0, palm_offset)


def _guess_scale(size: float, guessed: list[str]) -> float:
    if MIN_LENGTH_M <= size <= MAX_LENGTH_M or size < _SMALLEST_SIZE:
        return 1.0
    shortest, longest = _USUAL_LENGTHS_M
    for name, scale in _UNITS:
        if shortest <= size * scale <= longest:
            guessed.append(f"Its {size:.4g} units seem to be {name}: it is {size * scale:.2g} m long.")
            return scale
    guessed.append(f"Its unit is unknown, it has {size:.4g} of them: it is made {_DEFAULT_LENGTH_M} m long.")
    return _DEFAULT_LENGTH_M / size


def _find_in_hand(positions: Array, triangles: Triangles) -> Array:
    """Return points (n, 3) of a prop that are inside the hand: corners, and where edges cross the hand's borders."""
    start = positions[triangles].reshape(-1, 3)
    end = positions[np.roll(triangles, -1, axis=1)].reshape(-1, 3)
    rise = end[:, 1] - start[:, 1]
    points = [start[np.abs(start[:, 1]) <= _SLAB_M]]
    for border in (-_SLAB_M, 0.0, _SLAB_M):
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (border - start[:, 1]) / rise
        crosses = (rise != 0.0) & (share >= 0.0) & (share <= 1.0)
        points.append(start[crosses] + share[crosses, None] * (end[crosses] - start[crosses]))
    return np.vstack(points)
