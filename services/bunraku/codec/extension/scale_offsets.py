"""Offsets of the scales that the context model predicts, one for each axis of a track (proto/codec.md, 2.18).

The prior has learned how joints of a body move. An axis that moves less or more than these is coded with an offset.
"""

from __future__ import annotations

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import IntArray

SCALE_UNIT = 128
"""Unit of an offset: half a doubling, in the 1/256 of a doubling of the context model."""
MIN_SCALE_OFFSET, MAX_SCALE_OFFSET = -8, 7


def check_scale_offsets(offsets: IntArray) -> IntArray:
    """Return the offsets. Raises `DamagedBlock` if one is out of range."""
    if len(offsets) and not MIN_SCALE_OFFSET <= offsets.min() <= offsets.max() <= MAX_SCALE_OFFSET:
        raise DamagedBlock(
            f"Invalid extension: offsets of scales are {offsets.min()}..{offsets.max()}, expected "
            f"{MIN_SCALE_OFFSET}..{MAX_SCALE_OFFSET}."
        )
    return offsets


def to_scales(offsets: IntArray, channels: int) -> IntArray:
    """Return the offsets (channels, 3) in the units of the context model; axes beyond the last have none."""
    scales = np.zeros(channels * 3, dtype=np.int64)
    scales[: len(offsets)] = SCALE_UNIT * offsets
    return scales.reshape(channels, 3)
