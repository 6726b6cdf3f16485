"""Estimate of the bits that a coefficient costs, without running the range coder."""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.prior import HAZARD_ROWS, HAZARD_TABLE_OF, UNARY_DECISIONS, Prior
from bunraku.motion.rotation import Array


def build_cost_table(prior: Prior) -> Array:
    """Return the bits of each magnitude in each row of the hazard tables.

    Returns:
        (3 * HAZARD_ROWS, UNARY_DECISIONS + 1); the last column is the prefix of an escape.
    """
    p = prior.hazard / 32768.0
    ones = np.concatenate([np.zeros((len(p), 1)), np.cumsum(-np.log2(p), axis=1)], axis=1)
    stops = np.concatenate([-np.log2(1 - p), np.zeros((len(p), 1))], axis=1)
    table: Array = ones + stops
    return table


@njit(cache=True)
def coefficient_bits(costs: Array, frequency_class: int, scale: int, magnitude: int) -> float:
    """Return the bits of a coefficient, sign included, at a predicted `scale` (log2 in 1/256).

    The row is the nearest one; the coder interpolates between two rows.
    """
    shift = (scale >> 8) - 3 if scale >= 1024 else 0
    row = (
        min(((scale - shift * 256 + 7 * 256) * 4 + 128) >> 8, HAZARD_ROWS - 1)
        + HAZARD_ROWS * HAZARD_TABLE_OF[frequency_class]
    )
    bits = shift + (1.0 if magnitude > 0 else 0.0)
    high = magnitude >> shift
    if high < UNARY_DECISIONS:
        return bits + costs[row, high]  # type: ignore[no-any-return]
    rest, length = high - UNARY_DECISIONS + 1, 0
    while rest >> (length + 1) > 0:
        length += 1
    return bits + costs[row, UNARY_DECISIONS] + 2 * length + 1  # type: ignore[no-any-return]
