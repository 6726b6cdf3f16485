"""What a coefficient would cost, compiled: for the encoder's choices, in bits, with no arithmetic coder run."""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.forward_kinematics import Array
from bunraku.codec.prior import HAZARD_ROWS, HAZARD_TABLE_OF, UNARY_DECISIONS, Prior


def build_cost_table(prior: Prior) -> Array:
    """Bits (3 * ROWS, UNARY + 1) of each size at each scale in the prior's tables, the last the start of an escape."""
    p = prior.hazard / 32768.0
    ones = np.concatenate([np.zeros((len(p), 1)), np.cumsum(-np.log2(p), axis=1)], axis=1)
    stops = np.concatenate([-np.log2(1 - p), np.zeros((len(p), 1))], axis=1)
    table: Array = ones + stops
    return table


@njit(cache=True)
def coefficient_bits(table: Array, frequency_class: int, scale: int, magnitude: int) -> float:
    """Bits of a coefficient of class `group` and this `size`, sign included, where about 2^(scaled / 256) is
    expected."""
    shift = (scale >> 8) - 3 if scale >= 1024 else 0
    row = (
        min(((scale - shift * 256 + 7 * 256) * 4 + 128) >> 8, HAZARD_ROWS - 1)
        + HAZARD_ROWS * HAZARD_TABLE_OF[frequency_class]
    )
    cost = shift + (1.0 if magnitude > 0 else 0.0)
    high = magnitude >> shift
    if high < UNARY_DECISIONS:
        return cost + table[row, high]  # type: ignore[no-any-return]
    rest, length = high - UNARY_DECISIONS + 1, 0
    while rest >> (length + 1) > 0:
        length += 1
    return cost + table[row, UNARY_DECISIONS] + 2 * length + 1  # type: ignore[no-any-return]
