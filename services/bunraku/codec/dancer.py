"""A dancer in few bytes: limb lengths, and the pose that rotations are told from (SPEC.md, Dancer).

Whole numbers in the order below, each as Exp-Golomb with models that learn; a limb of the right side is told by what it
differs from the mirrored left, which is mostly nothing.
"""

from __future__ import annotations

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import Integers
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS, TIPS, Figure

FIGURE_UNIT = 1e-4
"""Metres in one unit of a figure's numbers."""
MOST_BITS = 14
"""Bits after the point of a reference in radians, at most."""
LARGEST = 1 << 16
"""Numbers are below this: a limb of 6.5 m."""
LARGEST_DANCER = 1024

_ROWS = JOINT_COUNT + len(TIPS)
_NAMES = [*JOINTS, *(JOINTS[joint] + " tip" for joint in TIPS)]
_TWIN = [_NAMES.index("l" + name[1:]) if name.startswith("r_") else -1 for name in _NAMES]
_FLIP = np.array([-1, 1, 1])
# models of: lengths on each axis, differences from the twin, references
GROUPS: Integers = np.array(
    [group for twin in _TWIN for group in ((0, 1, 2) if twin < 0 else (3, 3, 3))] + 3 * (JOINT_COUNT - 1) * [4],
    dtype=np.int64,
)


def on_grid(figure: Figure) -> Figure:
    """`figure` as it will be decoded: on the grid of `FIGURE_UNIT`. Raises ValueError for a limb longer than the code
    has."""
    numbers = np.round(np.concatenate([figure.offsets, figure.tips]) / FIGURE_UNIT)
    if abs(numbers).max() >= LARGEST // 2:
        raise ValueError(
            f"a limb is {abs(numbers).max() * FIGURE_UNIT:.1f} m long; {LARGEST // 2 * FIGURE_UNIT:.1f} m is the most"
        )
    return Figure(numbers[:JOINT_COUNT] * FIGURE_UNIT, numbers[JOINT_COUNT:] * FIGURE_UNIT)


def pack_dancer(figure: Figure, reference: Array, bits: int) -> bytes:
    """Bytes of a figure and of the whole numbers `reference` (17, 3) in 2^-`bits` radians."""
    lengths = np.round(np.concatenate([figure.offsets, figure.tips[list(TIPS)]]) / FIGURE_UNIT).astype(np.int64)
    for row in range(_ROWS - 1, -1, -1):
        if _TWIN[row] >= 0:
            lengths[row] -= _FLIP * lengths[_TWIN[row]]
    numbers = np.concatenate([lengths.ravel(), np.asarray(reference, dtype=np.int64).ravel()])
    return bytes([bits]) + coefficients.encode_numbers(numbers, GROUPS)


def unpack_dancer(data: bytes) -> tuple[Figure, Array, int]:
    """Figure, reference and bits of `pack_dancer`; raises `DamagedBlock`."""
    if not 1 <= len(data) <= LARGEST_DANCER:
        raise DamagedBlock(f"a dancer has 1..{LARGEST_DANCER} bytes, not {len(data)}")
    if data[0] > MOST_BITS:
        raise DamagedBlock(f"a dancer's reference is in 2^-{data[0]} radians; 2^-{MOST_BITS} is the finest")
    numbers = coefficients.decode_numbers(data[1:], GROUPS)
    lengths = numbers[: 3 * _ROWS].reshape(-1, 3)
    for row in range(_ROWS):
        if _TWIN[row] >= 0:
            lengths[row] += _FLIP * lengths[_TWIN[row]]
    tips = np.zeros((JOINT_COUNT, 3))
    tips[list(TIPS)] = lengths[JOINT_COUNT:] * FIGURE_UNIT
    offsets = np.asarray(lengths[:JOINT_COUNT] * FIGURE_UNIT, dtype=np.float64)
    return (
        Figure(offsets, tips),
        numbers[3 * _ROWS :].reshape(-1, 3).astype(np.float64),
        data[0],
    )
