"""A dancer in few bytes: limb lengths, and the pose that rotations are told from (SPEC.md, Dancer).

Whole numbers in the order below, each as Exp-Golomb with models that learn; a limb of the right side is told by how its
numbers' sizes differ from the left's, mostly not at all, and by whose signs do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.integer_coder import decode_integers, encode_integers
from bunraku.codec.prior import IntArray
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS, TIP_JOINTS, Figure

FINEST_GRID_M = 1e-4
"""Metres in one unit of a figure's numbers at grid 0; every grid is twice as coarse as the one before."""
MAX_GRID = 7
MAX_REFERENCE_BITS = 14
"""Bits after the point of a reference in radians, at most."""
INTEGER_LIMIT = 1 << 16
"""Numbers are below this: a limb of 6.5 m."""
MAX_SKELETON_BYTES = 1024

_LENGTH_ROWS = JOINT_COUNT + len(TIP_JOINTS)
_NAMES = [*JOINTS, *(JOINTS[joint] + " tip" for joint in TIP_JOINTS)]
_MIRROR_ROW = [_NAMES.index("l" + name[1:]) if name.startswith("r_") else -1 for name in _NAMES]
_MIRROR_ROWS = [*_MIRROR_ROW, *(_LENGTH_ROWS + twin if twin >= 0 else -1 for twin in _MIRROR_ROW[:JOINT_COUNT])]
MODEL_GROUPS: IntArray = np.array(
    [
        (3 if twin >= 0 else axis) + (0 if row < _LENGTH_ROWS else 4)
        for row, twin in enumerate(_MIRROR_ROWS)
        for axis in range(3)
    ],
    dtype=np.int64,
)
"""Models of each number: lengths on the three axes and what they differ from the twin's (0-3), and references (4-7)."""
MIRROR_OF: IntArray = np.array(
    [3 * twin + axis if twin >= 0 else -1 for twin in _MIRROR_ROWS for axis in range(3)], dtype=np.int64
)
"""Of each number the one before that it mirrors, or -1."""


@dataclass(frozen=True, slots=True)
class SkeletonDescription:
    """A `figure` on the grid `grid`, and the whole numbers `reference` (18, 3), each joint's typical rotation as a
    rotation vector in 2^-`reference_bits` radians; the root's as the dancer's left points along x."""

    figure: Figure
    grid: int
    reference: Array
    reference_bits: int

    def reference_rotations(self) -> Array:
        """`reference` as quaternions (18, 4)."""
        return rotation.from_rotation_vector(self.reference * 2.0**-self.reference_bits)

    def pack(self) -> bytes:
        """The dancer's bytes."""
        lengths = np.concatenate([self.figure.offsets, self.figure.tips[list(TIP_JOINTS)]]) / grid_unit_m(self.grid)
        numbers = np.round(np.concatenate([lengths.ravel(), self.reference.ravel()])).astype(np.int64)
        return bytes([self.grid << 4 | self.reference_bits]) + encode_integers(numbers, MODEL_GROUPS, MIRROR_OF)

    @classmethod
    def unpack(cls, data: bytes) -> SkeletonDescription:
        """The dancer of `pack`; raises `DamagedBlock`."""
        if not 1 <= len(data) <= MAX_SKELETON_BYTES:
            raise DamagedBlock(f"a dancer has 1..{MAX_SKELETON_BYTES} bytes, not {len(data)}")
        grid, bits = data[0] >> 4, data[0] & 15
        if grid > MAX_GRID or bits > MAX_REFERENCE_BITS:
            raise DamagedBlock(
                f"a dancer's grid is {grid} and its reference in 2^-{bits} radians; {MAX_GRID} and 2^-{MAX_REFERENCE_BITS} are "
                "the most"
            )
        numbers = decode_integers(data[1:], MODEL_GROUPS, MIRROR_OF)
        lengths = numbers[: 3 * _LENGTH_ROWS].reshape(-1, 3).astype(np.float64) * grid_unit_m(grid)
        tips = np.zeros((JOINT_COUNT, 3))
        tips[list(TIP_JOINTS)] = lengths[JOINT_COUNT:]
        reference = numbers[3 * _LENGTH_ROWS :].reshape(-1, 3).astype(np.float64)
        return cls(Figure(lengths[:JOINT_COUNT], tips), grid, reference, bits)


def grid_unit_m(grid: int) -> float:
    """Metres in one unit of a figure's numbers."""
    return FINEST_GRID_M * 2.0**grid


def snap_to_grid(figure: Figure, grid: int) -> Figure:
    """`figure` as it will be decoded. Raises ValueError for a limb longer than the code has."""
    numbers = np.round(np.concatenate([figure.offsets, figure.tips]) / grid_unit_m(grid))
    if abs(numbers).max() >= INTEGER_LIMIT // 2:
        longest, most = abs(numbers).max() * grid_unit_m(grid), INTEGER_LIMIT // 2 * grid_unit_m(grid)
        raise ValueError(f"a limb is {longest:.1f} m long; {most:.1f} m is the most")
    return Figure(numbers[:JOINT_COUNT] * grid_unit_m(grid), numbers[JOINT_COUNT:] * grid_unit_m(grid))
