"""Skeleton description: bone lengths and reference pose in few bytes (proto/codec.md, 2.4; wire key `dancer`).

A sequence of integers, each an Exp-Golomb code with adaptive models. An integer of the right side is coded as the
difference of its magnitude from that of the left side, mostly zero, and whether its sign differs.
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
"""Unit of a figure's integers at grid 0, metres. Each grid is twice as coarse as the one before."""
MAX_GRID = 7
MAX_REFERENCE_BITS = 14
"""Limit of the fractional bits of a reference in radians."""
INTEGER_LIMIT = 1 << 16
"""Integers of a figure are below half of this: a bone of 3.3 m at grid 0."""
MAX_SKELETON_BYTES = 1024

_LENGTH_ROWS = JOINT_COUNT + len(TIP_JOINTS)
_NAMES = [*JOINTS, *(JOINTS[joint] + " tip" for joint in TIP_JOINTS)]
_MIRROR_ROW = [_NAMES.index("l" + name[1:]) if name.startswith("r_") else -1 for name in _NAMES]
# rows of lengths, then of references
_MIRROR_ROWS = [*_MIRROR_ROW, *(_LENGTH_ROWS + row if row >= 0 else -1 for row in _MIRROR_ROW[:JOINT_COUNT])]
MODEL_GROUPS: IntArray = np.array(
    [
        (3 if mirror >= 0 else axis) + (0 if row < _LENGTH_ROWS else 4)
        for row, mirror in enumerate(_MIRROR_ROWS)
        for axis in range(3)
    ],
    dtype=np.int64,
)
"""Group of models of each integer: lengths by axis (0-2) and mirrored lengths (3), the same for references (4-7)."""
MIRROR_OF: IntArray = np.array(
    [3 * mirror + axis if mirror >= 0 else -1 for mirror in _MIRROR_ROWS for axis in range(3)], dtype=np.int64
)
"""Index of the earlier integer that each integer mirrors, or -1."""


@dataclass(frozen=True, slots=True)
class SkeletonDescription:
    """A figure on a grid, and the reference rotation of each joint.

    `reference` (18, 3) are integers: rotation vectors in units of 2^-`reference_bits` radians. That of the root applies
    to a figure whose left points along x.
    """

    figure: Figure
    grid: int
    reference: Array
    reference_bits: int

    def reference_rotations(self) -> Array:
        """Return `reference` as quaternions (18, 4)."""
        return rotation.from_rotation_vector(self.reference * 2.0**-self.reference_bits)

    def pack(self) -> bytes:
        """Encode the description."""
        lengths = np.concatenate([self.figure.offsets, self.figure.tips[list(TIP_JOINTS)]]) / grid_unit_m(self.grid)
        integers = np.round(np.concatenate([lengths.ravel(), self.reference.ravel()])).astype(np.int64)
        return bytes([self.grid << 4 | self.reference_bits]) + encode_integers(integers, MODEL_GROUPS, MIRROR_OF)

    @classmethod
    def unpack(cls, data: bytes) -> SkeletonDescription:
        """Decode the description of `pack`. Raises `DamagedBlock`."""
        if not 1 <= len(data) <= MAX_SKELETON_BYTES:
            raise DamagedBlock(f"Invalid skeleton description: {len(data)} bytes, expected 1..{MAX_SKELETON_BYTES}.")
        grid, bits = data[0] >> 4, data[0] & 15
        if grid > MAX_GRID or bits > MAX_REFERENCE_BITS:
            raise DamagedBlock(
                f"Invalid skeleton description: grid {grid} and {bits} reference bits, at most grid {MAX_GRID} and "
                f"{MAX_REFERENCE_BITS} bits are allowed."
            )
        integers = decode_integers(data[1:], MODEL_GROUPS, MIRROR_OF)
        lengths = integers[: 3 * _LENGTH_ROWS].reshape(-1, 3).astype(np.float64) * grid_unit_m(grid)
        tips = np.zeros((JOINT_COUNT, 3))
        tips[list(TIP_JOINTS)] = lengths[JOINT_COUNT:]
        reference = integers[3 * _LENGTH_ROWS :].reshape(-1, 3).astype(np.float64)
        return cls(Figure(lengths[:JOINT_COUNT], tips), grid, reference, bits)


class BoneTooLong(ValueError):
    """Bone that no integer of a skeleton description can hold."""


def grid_unit_m(grid: int) -> float:
    """Return the unit of a figure's integers, metres."""
    return FINEST_GRID_M * 2.0**grid


def snap_to_grid(figure: Figure, grid: int) -> Figure:
    """Return `figure` as it will be decoded. Raises `BoneTooLong` for a bone that is too long for the grid."""
    integers = np.round(np.concatenate([figure.offsets, figure.tips]) / grid_unit_m(grid))
    if abs(integers).max() >= INTEGER_LIMIT // 2:
        longest, limit = abs(integers).max() * grid_unit_m(grid), INTEGER_LIMIT // 2 * grid_unit_m(grid)
        raise BoneTooLong(f"A bone is {longest:.1f} m long; {limit:.1f} m is the limit.")
    return Figure(integers[:JOINT_COUNT] * grid_unit_m(grid), integers[JOINT_COUNT:] * grid_unit_m(grid))
