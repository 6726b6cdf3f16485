"""A dancer in few bytes: limb lengths, and the pose that rotations are told from (SPEC.md, Dancer).

Whole numbers in the order below, each as Exp-Golomb with models that learn; a limb of the right side is told by how its
numbers' sizes differ from the left's, mostly not at all, and by whose signs do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.numbers import decode_numbers, encode_numbers
from bunraku.codec.prior import Integers
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS, TIPS, Figure

FINEST_GRID = 1e-4
"""Metres in one unit of a figure's numbers at grid 0; every grid is twice as coarse as the one before."""
MOST_GRID = 7
MOST_BITS = 14
"""Bits after the point of a reference in radians, at most."""
LARGEST = 1 << 16
"""Numbers are below this: a limb of 6.5 m."""
LARGEST_DANCER = 1024

_ROWS = JOINT_COUNT + len(TIPS)
_NAMES = [*JOINTS, *(JOINTS[joint] + " tip" for joint in TIPS)]
_TWIN = [_NAMES.index("l" + name[1:]) if name.startswith("r_") else -1 for name in _NAMES]
_TWINS = [*_TWIN, *(_ROWS + twin if twin >= 0 else -1 for twin in _TWIN[:JOINT_COUNT])]
GROUPS: Integers = np.array(
    [(3 if twin >= 0 else axis) + (0 if row < _ROWS else 4) for row, twin in enumerate(_TWINS) for axis in range(3)],
    dtype=np.int64,
)
"""Models of each number: lengths on the three axes and what they differ from the twin's (0-3), and references (4-7)."""
TWINS: Integers = np.array(
    [3 * twin + axis if twin >= 0 else -1 for twin in _TWINS for axis in range(3)], dtype=np.int64
)
"""Of each number the one before that it mirrors, or -1."""


@dataclass(frozen=True, slots=True)
class Dancer:
    """A `figure` on the grid `grid`, and the whole numbers `reference` (18, 3), each joint's typical rotation as a
    rotation vector in 2^-`reference_bits` radians; the root's as the dancer's left points along x."""

    figure: Figure
    grid: int
    reference: Array
    reference_bits: int

    def rotations(self) -> Array:
        """`reference` as quaternions (18, 4)."""
        return rotation.from_rotation_vector(self.reference * 2.0**-self.reference_bits)

    def pack(self) -> bytes:
        """The dancer's bytes."""
        lengths = np.concatenate([self.figure.offsets, self.figure.tips[list(TIPS)]]) / unit(self.grid)
        numbers = np.round(np.concatenate([lengths.ravel(), self.reference.ravel()])).astype(np.int64)
        return bytes([self.grid << 4 | self.reference_bits]) + encode_numbers(numbers, GROUPS, TWINS)

    @classmethod
    def unpack(cls, data: bytes) -> Dancer:
        """The dancer of `pack`; raises `DamagedBlock`."""
        if not 1 <= len(data) <= LARGEST_DANCER:
            raise DamagedBlock(f"a dancer has 1..{LARGEST_DANCER} bytes, not {len(data)}")
        grid, bits = data[0] >> 4, data[0] & 15
        if grid > MOST_GRID or bits > MOST_BITS:
            raise DamagedBlock(
                f"a dancer's grid is {grid} and its reference in 2^-{bits} radians; {MOST_GRID} and 2^-{MOST_BITS} are "
                "the most"
            )
        numbers = decode_numbers(data[1:], GROUPS, TWINS)
        lengths = numbers[: 3 * _ROWS].reshape(-1, 3).astype(np.float64) * unit(grid)
        tips = np.zeros((JOINT_COUNT, 3))
        tips[list(TIPS)] = lengths[JOINT_COUNT:]
        reference = numbers[3 * _ROWS :].reshape(-1, 3).astype(np.float64)
        return cls(Figure(lengths[:JOINT_COUNT], tips), grid, reference, bits)


def unit(grid: int) -> float:
    """Metres in one unit of a figure's numbers."""
    return FINEST_GRID * 2.0**grid


def on_grid(figure: Figure, grid: int) -> Figure:
    """`figure` as it will be decoded. Raises ValueError for a limb longer than the code has."""
    numbers = np.round(np.concatenate([figure.offsets, figure.tips]) / unit(grid))
    if abs(numbers).max() >= LARGEST // 2:
        longest, most = abs(numbers).max() * unit(grid), LARGEST // 2 * unit(grid)
        raise ValueError(f"a limb is {longest:.1f} m long; {most:.1f} m is the most")
    return Figure(numbers[:JOINT_COUNT] * unit(grid), numbers[JOINT_COUNT:] * unit(grid))
