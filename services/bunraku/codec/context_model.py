"""From what is coded already to the scale of the next coefficient, compiled (SPEC.md, Contexts).

Coefficients are int64 (19, 3, K): channel, axis, frequency; they are coded channel by channel, frequency by frequency,
axis by axis. Everything is integers, so that both languages reach the same bits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bunraku.codec.prior import (
    FREQUENCY_CLASS_OF,
    HIDDEN_UNITS,
    MAGNITUDE_LEVELS,
    RELATIVE_CHANNELS,
    SHARED_FEATURES,
    IntArray,
    Prior,
)

MIN_SCALE = -7 * 256
MAX_SCALE = 14 * 256
"""Scales are kept within these, in 1/256 octave."""
_PADDING_BEFORE = 3


class ContextModel(NamedTuple):
    """Levels of what is coded: `axis` (19, 3, K + 8) of each coefficient and `mean` (19, K + 8) over its axes,
    shifted by three so that there are zeros on both sides; `total` (K + 8) of the means over the channels done; `run`
    (K + 1) of the means of this channel up to each frequency; and room for the sums: `shared` (1 + HIDDEN),
    `features` (32)."""

    axis_levels: IntArray
    mean_levels: IntArray
    level_totals: IntArray
    running_sums: IntArray
    shared_sums: IntArray
    features: IntArray


@njit(cache=True)
def create_context_model(count: int) -> ContextModel:
    """`Seen` of a block of `count` frequencies at its start."""
    return ContextModel(
        np.zeros((19, 3, count + 8), np.int64),
        np.zeros((19, count + 8), np.int64),
        np.zeros(count + 8, np.int64),
        np.zeros(count + 1, np.int64),
        np.zeros(1 + HIDDEN_UNITS, np.int64),
        np.zeros(32, np.int64),
    )


@njit(cache=True)
def magnitude_level(magnitude: int) -> int:
    """16 log2(1 + size), rounded."""
    return MAGNITUDE_LEVELS[min(magnitude, 4095)]  # type: ignore[no-any-return]


@njit(cache=True)
def compute_shared_sums(
    prior: Prior, context: ContextModel, channel: int, k: int, count: int, step: int, duration_level: int
) -> None:
    """Sum up what the three axes of frequency `k` of `count` share; `step` is the step index, `length` the level of the
    block's duration."""
    f, mean, total, kk = context.features, context.mean_levels, context.level_totals, k + _PADDING_BEFORE
    f[0], f[1], f[2] = mean[channel, kk - 1], mean[channel, kk - 2], mean[channel, kk - 3]
    for which in range(2):
        relative = RELATIVE_CHANNELS[which, channel]
        at = 3 + 4 * which
        if relative >= 0:
            m = mean[relative]
            f[at], f[at + 1], f[at + 2] = m[kk], m[kk - 1], m[kk + 1]
            f[at + 3] = (m[kk + 2] + m[kk + 3] + m[kk + 4]) // 3
        else:
            f[at], f[at + 1], f[at + 2], f[at + 3] = 0, 0, 0, 0
    grandparent = RELATIVE_CHANNELS[2, channel]
    if grandparent >= 0:
        f[11] = mean[grandparent, kk]
        f[12] = (mean[grandparent, kk + 1] + mean[grandparent, kk + 2]) >> 1
    else:
        f[11], f[12] = 0, 0
    done = max(channel, 1)
    f[13], f[14], f[15] = total[kk] // done, total[kk - 1] // done, total[kk + 1] // done
    f[16] = (total[kk + 2] + total[kk + 3] + total[kk + 4]) // (3 * done)
    f[17] = context.running_sums[k] // (k + 1)
    f[18] = mean[channel - 1, kk] if channel > 0 else 0
    f[19] = mean[channel - 2, kk] if channel > 1 else 0
    f[20], f[21], f[22], f[23] = min(count - k, 63), magnitude_level(k), step, duration_level
    group = FREQUENCY_CLASS_OF[k]
    sums = context.shared_sums
    sums[0] = 0
    for i in range(SHARED_FEATURES):
        sums[0] += f[i] * prior.linear[group, i]
    for j in range(HIDDEN_UNITS):
        total_j = prior.hidden_class[j, group]
        for i in range(SHARED_FEATURES):
            total_j += f[i] * prior.hidden[j, i]
        sums[1 + j] = total_j


@njit(cache=True)
def predict_scale(prior: Prior, context: ContextModel, channel: int, axis: int, k: int) -> int:
    """The expected size of one coefficient: log2 in 1/256, after `share` of its frequency."""
    f, kk = context.features, k + _PADDING_BEFORE
    own, parent, mirror = (
        context.axis_levels[channel, axis],
        RELATIVE_CHANNELS[0, channel],
        RELATIVE_CHANNELS[1, channel],
    )
    f[24], f[25], f[26] = own[kk - 1], own[kk - 2], own[kk - 3]
    f[27] = context.axis_levels[channel, 0, kk] if axis > 0 else 0
    f[28] = context.axis_levels[channel, 1, kk] if axis > 1 else 0
    f[29] = context.axis_levels[parent, axis, kk] if parent >= 0 else 0
    f[30] = context.axis_levels[mirror, axis, kk] if mirror >= 0 else 0
    f[31] = context.axis_levels[mirror, axis, kk + 1] if mirror >= 0 else 0
    group, which = FREQUENCY_CLASS_OF[k], 3 * channel + axis
    linear = context.shared_sums[0] + prior.bias[group, which]
    for i in range(SHARED_FEATURES, 32):
        linear += f[i] * prior.linear[group, i]
    result = linear >> 8
    for j in range(HIDDEN_UNITS):
        x = context.shared_sums[1 + j] + prior.hidden_bias[j, which]
        for i in range(SHARED_FEATURES, 32):
            x += f[i] * prior.hidden[j, i]
        if x > 0:
            result += (min(x >> 8, 32767) * prior.out[j, group]) >> 12
    return min(max(result, MIN_SCALE), MAX_SCALE)  # type: ignore[no-any-return]


@njit(cache=True)
def update_magnitude(context: ContextModel, channel: int, axis: int, k: int, magnitude: int) -> None:
    """Note the size of a coefficient just coded."""
    context.axis_levels[channel, axis, k + _PADDING_BEFORE] = magnitude_level(magnitude)


@njit(cache=True)
def finish_frequency(context: ContextModel, channel: int, k: int) -> None:
    """Note that the three axes of a frequency are coded."""
    kk, axis = k + _PADDING_BEFORE, context.axis_levels[channel]
    context.mean_levels[channel, kk] = (axis[0, kk] + axis[1, kk] + axis[2, kk]) // 3
    context.running_sums[k + 1] = context.running_sums[k] + context.mean_levels[channel, kk]


@njit(cache=True)
def finish_channel(context: ContextModel, channel: int, count: int) -> None:
    """Note that a channel is coded."""
    for kk in range(_PADDING_BEFORE, count + _PADDING_BEFORE):
        context.level_totals[kk] += context.mean_levels[channel, kk]


@njit(cache=True)
def sign_context(q: IntArray, channel: int, axis: int, k: int) -> int:
    """Context of a sign: a movement that a block cuts off leaves every second frequency with one sign."""
    near = min(max(q[channel, axis, k - 2], -2), 2) if k > 2 else 0
    far = min(max(q[channel, axis, k - 4], -1), 1) if k > 4 else 0
    return 3 * (near + 2) + far + 1
