"""Context model: predicts the scale of the next coefficient from those already coded (proto/codec.md, 2.10 and 2.11).

Coefficients are int64 (C, 3, K): channel, axis, frequency. They are coded channel by channel, frequency by frequency,
axis by axis. All arithmetic is in integers, so that Python and TypeScript decode the same bits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bunraku.codec.channel_layout import GRANDPARENT, MIRROR, PARENT, ChannelLayout
from bunraku.codec.prior import (
    FEATURE_COUNT,
    FREQUENCY_CLASS_OF,
    HIDDEN_UNITS,
    MAGNITUDE_LEVELS,
    SHARED_FEATURES,
    IntArray,
    Prior,
)

MIN_SCALE = -7 * 256
"""Smallest predicted scale, log2 in 1/256."""
MAX_SCALE = 14 * 256
_PADDING_BEFORE = 3
_PADDING_TOTAL = 8


class ContextModel(NamedTuple):
    """Magnitude levels of the coefficients of one block that are already coded.

    `frequencies` (K), the `step` index and `duration_level` describe the block. `axis_levels` (C, 3, K + 8) are the
    levels of the coefficients, `mean_levels` (C, K + 8) their means over the axes, `level_totals` (K + 8) the sums of
    these over the finished channels: three zeros come before the frequencies and five after. `running_sums` (K + 1)
    are the sums of this channel's means below each frequency. `shared_sums` (1 + HIDDEN_UNITS) and `features` (32)
    are buffers.
    """

    prior: Prior
    layout: ChannelLayout
    frequencies: int
    step: int
    duration_level: int
    axis_levels: IntArray
    mean_levels: IntArray
    level_totals: IntArray
    running_sums: IntArray
    shared_sums: IntArray
    features: IntArray


@njit(cache=True)
def create_context_model(
    prior: Prior, layout: ChannelLayout, frequencies: int, step: int, duration_level: int
) -> ContextModel:
    """Return the context model of a block of which nothing is coded."""
    channels = len(layout.axes)
    return ContextModel(
        prior,
        layout,
        frequencies,
        step,
        duration_level,
        np.zeros((channels, 3, frequencies + _PADDING_TOTAL), np.int64),
        np.zeros((channels, frequencies + _PADDING_TOTAL), np.int64),
        np.zeros(frequencies + _PADDING_TOTAL, np.int64),
        np.zeros(frequencies + 1, np.int64),
        np.zeros(1 + HIDDEN_UNITS, np.int64),
        np.zeros(FEATURE_COUNT, np.int64),
    )


@njit(cache=True)
def magnitude_level(magnitude: int) -> int:
    """Return 16 log2(1 + magnitude), rounded; magnitudes above 4095 have the level of 4095."""
    return MAGNITUDE_LEVELS[min(magnitude, 4095)]  # type: ignore[no-any-return]


@njit(cache=True)
def compute_shared_sums(context: ContextModel, channel: int, k: int) -> None:
    """Compute the features and sums that the three axes of frequency `k` share."""
    prior = context.prior
    f, mean, total, kk = context.features, context.mean_levels, context.level_totals, k + _PADDING_BEFORE
    f[0], f[1], f[2] = mean[channel, kk - 1], mean[channel, kk - 2], mean[channel, kk - 3]
    for relation in (PARENT, MIRROR):
        relative = context.layout.relatives[relation, channel]
        first = 3 + 4 * relation
        if relative >= 0:
            m = mean[relative]
            f[first], f[first + 1], f[first + 2] = m[kk], m[kk - 1], m[kk + 1]
            f[first + 3] = (m[kk + 2] + m[kk + 3] + m[kk + 4]) // 3
        else:
            f[first], f[first + 1], f[first + 2], f[first + 3] = 0, 0, 0, 0
    grandparent = context.layout.relatives[GRANDPARENT, channel]
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
    f[20], f[21] = min(context.frequencies - k, 63), magnitude_level(k)
    f[22], f[23] = context.step, context.duration_level
    frequency_class = FREQUENCY_CLASS_OF[k]
    sums = context.shared_sums
    sums[0] = 0
    for i in range(SHARED_FEATURES):
        sums[0] += f[i] * prior.linear[frequency_class, i]
    for unit in range(HIDDEN_UNITS):
        x = prior.hidden_class[unit, frequency_class]
        for i in range(SHARED_FEATURES):
            x += f[i] * prior.hidden[unit, i]
        sums[1 + unit] = x


@njit(cache=True)
def predict_scale(context: ContextModel, channel: int, axis: int, k: int) -> int:
    """Return the predicted scale of one coefficient, log2 in 1/256.

    `compute_shared_sums` of its frequency must come first.
    """
    prior, f, kk = context.prior, context.features, k + _PADDING_BEFORE
    own, parent, mirror = (
        context.axis_levels[channel, axis],
        context.layout.relatives[PARENT, channel],
        context.layout.relatives[MIRROR, channel],
    )
    f[24], f[25], f[26] = own[kk - 1], own[kk - 2], own[kk - 3]
    f[27] = context.axis_levels[channel, 0, kk] if axis > 0 else 0
    f[28] = context.axis_levels[channel, 1, kk] if axis > 1 else 0
    f[29] = context.axis_levels[parent, axis, kk] if parent >= 0 else 0
    f[30] = context.axis_levels[mirror, axis, kk] if mirror >= 0 else 0
    f[31] = context.axis_levels[mirror, axis, kk + 1] if mirror >= 0 else 0
    frequency_class, prior_axis = FREQUENCY_CLASS_OF[k], 3 * context.layout.prior_channels[channel] + axis
    linear = context.shared_sums[0] + prior.bias[frequency_class, prior_axis]
    for i in range(SHARED_FEATURES, FEATURE_COUNT):
        linear += f[i] * prior.linear[frequency_class, i]
    scale = linear >> 8
    for unit in range(HIDDEN_UNITS):
        x = context.shared_sums[1 + unit] + prior.hidden_bias[unit, prior_axis]
        for i in range(SHARED_FEATURES, FEATURE_COUNT):
            x += f[i] * prior.hidden[unit, i]
        if x > 0:
            scale += (min(x >> 8, 32767) * prior.out[unit, frequency_class]) >> 12
    scale += context.layout.scale_offsets[channel, axis]
    return min(max(scale, MIN_SCALE), MAX_SCALE)  # type: ignore[no-any-return]


@njit(cache=True)
def update_magnitude(context: ContextModel, channel: int, axis: int, k: int, magnitude: int) -> None:
    """Store the level of a coefficient."""
    context.axis_levels[channel, axis, k + _PADDING_BEFORE] = magnitude_level(magnitude)


@njit(cache=True)
def finish_frequency(context: ContextModel, channel: int, k: int) -> None:
    """Update the means of a frequency after its three axes."""
    kk, axis = k + _PADDING_BEFORE, context.axis_levels[channel]
    context.mean_levels[channel, kk] = (axis[0, kk] + axis[1, kk] + axis[2, kk]) // 3
    context.running_sums[k + 1] = context.running_sums[k] + context.mean_levels[channel, kk]


@njit(cache=True)
def finish_channel(context: ContextModel, channel: int) -> None:
    """Add the means of a finished channel to the totals."""
    for kk in range(_PADDING_BEFORE, context.frequencies + _PADDING_BEFORE):
        context.level_totals[kk] += context.mean_levels[channel, kk]


@njit(cache=True)
def sign_context(q: IntArray, channel: int, axis: int, k: int) -> int:
    """Return the context of a sign, 0..14, from the coefficients two and four frequencies below.

    If a block cuts a movement off, every second frequency has the same sign.
    """
    near = min(max(q[channel, axis, k - 2], -2), 2) if k > 2 else 0
    far = min(max(q[channel, axis, k - 4], -1), 1) if k > 4 else 0
    return 3 * (near + 2) + far + 1
