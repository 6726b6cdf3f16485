"""Entropy coder of a block: header and coefficients through context model, prior and range coder.

One code path both encodes and decodes, so that the two cannot differ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bunraku.codec._kernels.context_model import (
    compute_shared_sums,
    create_context_model,
    finish_channel,
    finish_frequency,
    predict_scale,
    sign_context,
    update_magnitude,
)
from bunraku.codec._kernels.range_coder import (
    HALF_PROBABILITY,
    ByteArray,
    decode_bit,
    encode_bit,
    finish_encoder,
    start_decoder,
    start_encoder,
)
from bunraku.codec.channel_layout import ChannelLayout
from bunraku.codec.prior import (
    FEATURE_COUNT,
    FREQUENCY_CLASS_OF,
    HAZARD_ROWS,
    HAZARD_TABLE_OF,
    MAX_BLOCK_FRAMES,
    UNARY_DECISIONS,
    IntArray,
    Prior,
)

MAX_ESCAPE_BITS = 20
"""Bits of an escape's unary part that no valid block reaches."""
_NOMINAL_FRAMES_PROBABILITY = 32440
_FRAME_COUNT_BITS = 10
_ROOT_ONLY_PROBABILITY = 512

HEADER_FRAMES, HEADER_STEP, HEADER_HEADING, HEADER_FREQUENCIES, HEADER_CHANNELS = range(5)
"""Indices into a header: frames, step index, heading (-32..31), frequencies, and coded channels.

Channels of a layout with a heading may be 2 if all joints keep their reference. Blocks of other layouts contain neither
them nor a heading.
"""
LABEL_CLASS, LABEL_CHANNEL_AXIS, LABEL_MAGNITUDE, LABEL_SIGN, LABEL_SIGN_CONTEXT = range(5)
"""Columns of a training example's label; the sign is 0 for none, 1 for plus, 2 for minus."""


class BitCoder(NamedTuple):
    """A range coder in one direction: `data` is what it reads or writes."""

    decoding: bool
    state: IntArray
    data: ByteArray


@njit(cache=True)
def _code_bit(coder: BitCoder, probability: int, bit: int) -> int:
    if coder.decoding:
        return decode_bit(coder.state, coder.data, probability)
    encode_bit(coder.state, coder.data, probability, bit)
    return bit


@njit(cache=True)
def _code_bits(coder: BitCoder, bits: int, value: int) -> int:
    result = 0
    for i in range(bits - 1, -1, -1):
        result = result << 1 | _code_bit(coder, HALF_PROBABILITY, (value >> i) & 1)
    return result


@njit(cache=True)
def bit_length(value: int) -> int:
    """Return the bits of a number, 0 for zero."""
    bits = 0
    while value >> bits > 0:
        bits += 1
    return bits


@njit(cache=True)
def _code_header(coder: BitCoder, layout: ChannelLayout, nominal_frames: int, header: IntArray) -> bool:
    """Code a block's header; return False if it is invalid."""
    if _code_bit(coder, _NOMINAL_FRAMES_PROBABILITY, 1 if header[HEADER_FRAMES] == nominal_frames else 0):
        header[HEADER_FRAMES] = nominal_frames
    else:
        header[HEADER_FRAMES] = _code_bits(coder, _FRAME_COUNT_BITS, header[HEADER_FRAMES])
    if not 1 <= header[HEADER_FRAMES] <= MAX_BLOCK_FRAMES:
        return False
    if layout.heading:
        root_only = _code_bit(coder, _ROOT_ONLY_PROBABILITY, 1 if header[HEADER_CHANNELS] == 2 else 0)
        header[HEADER_CHANNELS] = 2 if root_only else len(layout.axes)
    header[HEADER_STEP] = _code_bits(coder, 8, header[HEADER_STEP])
    if layout.heading:
        header[HEADER_HEADING] = _code_bits(coder, 6, header[HEADER_HEADING] + 32) - 32
    header[HEADER_FREQUENCIES] = _code_bits(coder, bit_length(header[HEADER_FRAMES]), header[HEADER_FREQUENCIES])
    return header[HEADER_FREQUENCIES] <= header[HEADER_FRAMES]  # type: ignore[no-any-return]


@njit(cache=True)
def _code_magnitude(coder: BitCoder, hazard: IntArray, frequency_class: int, scale: int, magnitude: int) -> int:
    """Code the magnitude of a coefficient at a predicted scale; return it, or -1 if it is invalid."""
    shift = (scale >> 8) - 3 if scale >= 1024 else 0
    position = (scale - shift * 256 + 7 * 256) * 4
    row, weight = position >> 8, position & 255
    if row > HAZARD_ROWS - 2:
        row, weight = HAZARD_ROWS - 2, 256
    row += HAZARD_ROWS * HAZARD_TABLE_OF[frequency_class]
    high, value = magnitude >> shift, 0
    while value < UNARY_DECISIONS:
        probability = (hazard[row, value] * (256 - weight) + hazard[row + 1, value] * weight) >> 8
        if not _code_bit(coder, probability, 1 if high > value else 0):
            break
        value += 1
    if value == UNARY_DECISIONS:
        rest = high - UNARY_DECISIONS + 1
        bits, length = bit_length(rest) - 1 if not coder.decoding else 0, 0
        while length < MAX_ESCAPE_BITS and _code_bit(coder, HALF_PROBABILITY, 1 if bits > length else 0):
            length += 1
        if length == MAX_ESCAPE_BITS:
            return -1
        value += (1 << length | _code_bits(coder, length, rest)) - 1
    return value << shift | _code_bits(coder, shift, magnitude)


@njit(cache=True)
def _code_coefficients(
    coder: BitCoder, prior: Prior, layout: ChannelLayout, q: IntArray, header: IntArray, duration_level: int
) -> bool:
    """Code the coefficients of a block; return False if one is invalid."""
    channels, frequencies = header[HEADER_CHANNELS], header[HEADER_FREQUENCIES]
    context = create_context_model(prior, layout, frequencies, header[HEADER_STEP], duration_level)
    for channel in range(channels):
        axes = layout.axes[channel]
        for k in range(frequencies):
            compute_shared_sums(context, channel, k)
            for axis in range(axes):
                scale = predict_scale(context, channel, axis, k)
                magnitude = _code_magnitude(coder, prior.hazard, FREQUENCY_CLASS_OF[k], scale, abs(q[channel, axis, k]))
                if magnitude < 0:
                    return False
                if magnitude > 0:
                    probability = prior.sign[FREQUENCY_CLASS_OF[k], sign_context(q, channel, axis, k)]
                    negative = _code_bit(coder, probability, 1 if q[channel, axis, k] < 0 else 0)
                    q[channel, axis, k] = -magnitude if negative else magnitude
                update_magnitude(context, channel, axis, k, magnitude)
            finish_frequency(context, channel, k)
        finish_channel(context, channel)
    return True


@njit(cache=True, nogil=True)
def encode_block(
    prior: Prior,
    layout: ChannelLayout,
    q: IntArray,
    header: IntArray,
    nominal_frames: int,
    duration_level: int,
    out: ByteArray,
) -> int:
    """Write a block into `out` and return its length, or -1 if a coefficient is too large.

    The first byte is always zero and not part of the block.
    """
    coder = BitCoder(False, start_encoder(), out)
    if not _code_header(coder, layout, nominal_frames, header) or not _code_coefficients(
        coder, prior, layout, q, header, duration_level
    ):
        return -1
    return finish_encoder(coder.state, out)


@njit(cache=True)
def decode_header(data: ByteArray, layout: ChannelLayout, nominal_frames: int, header: IntArray) -> bool:
    """Read only the header of a block; return False if it is invalid."""
    return _code_header(BitCoder(True, start_decoder(data), data), layout, nominal_frames, header)


@njit(cache=True, nogil=True)
def decode_block(
    prior: Prior,
    layout: ChannelLayout,
    data: ByteArray,
    q: IntArray,
    header: IntArray,
    nominal_frames: int,
    duration_level: int,
) -> bool:
    """Read a block into `q`, zeros of (channels, 3, frequencies); return False if it is invalid."""
    coder = BitCoder(True, start_decoder(data), data)
    return _code_header(coder, layout, nominal_frames, header) and _code_coefficients(
        coder, prior, layout, q, header, duration_level
    )


@njit(cache=True)
def collect_examples(
    prior: Prior, layout: ChannelLayout, q: IntArray, header: IntArray, duration_level: int
) -> tuple[IntArray, IntArray]:
    """Return the training examples of a motion block, in the order in which its coefficients are coded.

    Returns:
        Features (N, 32) and labels (N, 5), columns LABEL_..., of all N coefficients of `q` (19, 3, K).
    """
    frequencies, row = header[HEADER_FREQUENCIES], 0
    features, labels = np.zeros((q.size, FEATURE_COUNT), np.int64), np.zeros((q.size, 5), np.int64)
    context = create_context_model(prior, layout, frequencies, header[HEADER_STEP], duration_level)
    for channel in range(header[HEADER_CHANNELS]):
        for k in range(frequencies):
            compute_shared_sums(context, channel, k)
            for axis in range(3):
                predict_scale(context, channel, axis, k)
                features[row] = context.features
                value = q[channel, axis, k]
                labels[row, LABEL_CLASS] = FREQUENCY_CLASS_OF[k]
                labels[row, LABEL_CHANNEL_AXIS] = 3 * channel + axis
                labels[row, LABEL_MAGNITUDE] = abs(value)
                labels[row, LABEL_SIGN] = 0 if value == 0 else 1 if value > 0 else 2
                labels[row, LABEL_SIGN_CONTEXT] = sign_context(q, channel, axis, k)
                row += 1
                update_magnitude(context, channel, axis, k, abs(value))
            finish_frequency(context, channel, k)
        finish_channel(context, channel)
    return features, labels


@njit(cache=True)
def allocate_output(q: IntArray) -> ByteArray:
    """Return a buffer that is large enough for any block with these coefficients."""
    return np.zeros(64 + q.size * 10, dtype=np.uint8)
