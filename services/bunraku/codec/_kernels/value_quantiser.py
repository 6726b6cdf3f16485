"""Quantisation of values that are no rotations of a body: those of extensions.

Coefficients come as `spectrum` (C, 3, K), in quantiser steps.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec._kernels.bit_cost import coefficient_bits
from bunraku.codec._kernels.context_model import (
    MAX_SCALE,
    MIN_SCALE,
    ContextModel,
    compute_shared_sums,
    finish_channel,
    finish_frequency,
    predict_scale,
    update_magnitude,
)
from bunraku.codec._kernels.forward_kinematics import reconstruct
from bunraku.codec.prior import FREQUENCY_CLASS_OF, IntArray
from bunraku.motion.rotation import Array


@njit(cache=True)
def quantise_values(context: ContextModel, costs: Array, spectrum: Array, bit_price: float, q: IntArray) -> None:
    """Quantise a block into `q` (C, 3, K) for the lowest sum of squared errors and bits, coefficient by coefficient.

    A bit costs as much as a squared error of `bit_price` squared steps. `costs` is `build_cost_table(prior)`.
    """
    for channel in range(len(spectrum)):
        for k in range(context.frequencies):
            compute_shared_sums(context, channel, k)
            for axis in range(context.layout.axes[channel]):
                ideal = abs(spectrum[channel, axis, k])
                nearest, best = int(ideal + 0.5), 0
                if nearest > 0:
                    scale = predict_scale(context, channel, axis, k)
                    lowest_cost = np.inf
                    for candidate in (nearest, nearest - 1, 0):
                        error = ideal - reconstruct(candidate)
                        bits = coefficient_bits(costs, FREQUENCY_CLASS_OF[k], scale, candidate)
                        cost = error * error + bit_price * bits
                        if cost < lowest_cost:
                            lowest_cost, best = cost, candidate
                q[channel, axis, k] = best if spectrum[channel, axis, k] > 0 else -best
                update_magnitude(context, channel, axis, k, best)
            finish_frequency(context, channel, k)
        finish_channel(context, channel)


@njit(cache=True)
def add_offset_costs(context: ContextModel, costs: Array, q: IntArray, offsets: IntArray, totals: Array) -> None:
    """Add the bits of each axis of a block to `totals` (C, 3, n), for each of the n `offsets` of its scale."""
    for channel in range(len(q)):
        for k in range(context.frequencies):
            compute_shared_sums(context, channel, k)
            for axis in range(context.layout.axes[channel]):
                scale = predict_scale(context, channel, axis, k)
                magnitude = abs(q[channel, axis, k])
                for number in range(len(offsets)):
                    shifted = min(max(scale + offsets[number], MIN_SCALE), MAX_SCALE)
                    totals[channel, axis, number] += coefficient_bits(costs, FREQUENCY_CLASS_OF[k], shifted, magnitude)
                update_magnitude(context, channel, axis, k, magnitude)
            finish_frequency(context, channel, k)
        finish_channel(context, channel)
