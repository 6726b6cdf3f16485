"""What a coefficient would cost, compiled: for the encoder's choices, in bits, with no arithmetic coder run."""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.bodies import Array
from bunraku.codec.prior import HAZARD_OF, ROWS, UNARY, Prior


def cost_table(prior: Prior) -> Array:
    """Bits (3 * ROWS, UNARY + 1) of each size at each scale in the prior's tables, the last the start of an escape."""
    p = prior.hazard / 32768.0
    ones = np.concatenate([np.zeros((len(p), 1)), np.cumsum(-np.log2(p), axis=1)], axis=1)
    stops = np.concatenate([-np.log2(1 - p), np.zeros((len(p), 1))], axis=1)
    table: Array = ones + stops
    return table


@njit(cache=True)
def bits(table: Array, group: int, scaled: int, size: int) -> float:
    """Bits of a coefficient of class `group` and this `size`, sign included, where about 2^(scaled / 256) is
    expected."""
    shift = (scaled >> 8) - 3 if scaled >= 1024 else 0
    row = min(((scaled - shift * 256 + 7 * 256) * 4 + 128) >> 8, ROWS - 1) + ROWS * HAZARD_OF[group]
    cost = shift + (1.0 if size > 0 else 0.0)
    high = size >> shift
    if high < UNARY:
        return cost + table[row, high]  # type: ignore[no-any-return]
    rest, length = high - UNARY + 1, 0
    while rest >> (length + 1) > 0:
        length += 1
    return cost + table[row, UNARY] + 2 * length + 1  # type: ignore[no-any-return]
