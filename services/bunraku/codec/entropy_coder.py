"""The compiled inside of the codec: coefficients through contexts and prior into the range coder and back.

A module of its own because importing numba takes seconds: `coefficients` loads it at its first use, so that programs
which only pass blocks on start at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.coefficients import SCENE_CHANNEL_COUNT
from bunraku.codec.context_model import (
    compute_shared_sums,
    create_context_model,
    finish_channel,
    finish_frequency,
    predict_scale,
    sign_context,
    update_magnitude,
)
from bunraku.codec.prior import (
    FREQUENCY_CLASS_OF,
    HAZARD_ROWS,
    HAZARD_TABLE_OF,
    MAX_BLOCK_FRAMES,
    UNARY_DECISIONS,
    IntArray,
    Prior,
)
from bunraku.codec.range_coder import (
    HALF_PROBABILITY,
    ByteArray,
    decode_bit,
    encode_bit,
    finish_encoder,
    start_decoder,
    start_encoder,
)

MAX_ESCAPE_BITS = 20
"""Bits of an escape's length, at most."""
_NOMINAL_FRAMES_PROBABILITY = 32440
_FRAME_COUNT_BITS = 10

_ROOT_ONLY_PROBABILITY = 512
HEADER_FRAMES, HEADER_STEP, HEADER_HEADING, HEADER_FREQUENCIES, HEADER_CHANNELS = range(5)
"""Places in a block's head: frames, step index, heading (-32..31), frequencies, and channels that are coded: 19, or 2
where all joints stand as their references; a scene's 3 are known beforehand, and its head says neither them nor a
heading."""


@njit(cache=True)
def _code_bit(decoding: bool, state: IntArray, data: ByteArray, probability: int, bit: int) -> int:
    if decoding:
        return decode_bit(state, data, probability)
    encode_bit(state, data, probability, bit)
    return bit


@njit(cache=True)
def _code_bits(decoding: bool, state: IntArray, data: ByteArray, bits: int, value: int) -> int:
    result = 0
    for i in range(bits - 1, -1, -1):
        result = result << 1 | _code_bit(decoding, state, data, HALF_PROBABILITY, (value >> i) & 1)
    return result


@njit(cache=True)
def bit_length(value: int) -> int:
    """Bits of a positive number."""
    bits = 0
    while value >> bits > 0:
        bits += 1
    return bits


@njit(cache=True)
def _code_header(decoding: bool, state: IntArray, data: ByteArray, nominal_frames: int, header: IntArray) -> bool:
    """A block's head; False where it cannot be one."""
    if _code_bit(
        decoding, state, data, _NOMINAL_FRAMES_PROBABILITY, 1 if header[HEADER_FRAMES] == nominal_frames else 0
    ):
        header[HEADER_FRAMES] = nominal_frames
    else:
        header[HEADER_FRAMES] = _code_bits(decoding, state, data, _FRAME_COUNT_BITS, header[HEADER_FRAMES])
    if not 1 <= header[HEADER_FRAMES] <= MAX_BLOCK_FRAMES:
        return False
    scene = header[HEADER_CHANNELS] == SCENE_CHANNEL_COUNT
    if not scene:
        alone = _code_bit(decoding, state, data, _ROOT_ONLY_PROBABILITY, 1 if header[HEADER_CHANNELS] == 2 else 0)
        header[HEADER_CHANNELS] = 2 if alone else 19
    header[HEADER_STEP] = _code_bits(decoding, state, data, 8, header[HEADER_STEP])
    if not scene:
        header[HEADER_HEADING] = _code_bits(decoding, state, data, 6, header[HEADER_HEADING] + 32) - 32
    header[HEADER_FREQUENCIES] = _code_bits(
        decoding, state, data, bit_length(header[HEADER_FRAMES]), header[HEADER_FREQUENCIES]
    )
    return header[HEADER_FREQUENCIES] <= header[HEADER_FRAMES]  # type: ignore[no-any-return]


@njit(cache=True)
def _code_magnitude(
    decoding: bool, state: IntArray, data: ByteArray, hazard: IntArray, frequency_class: int, scale: int, magnitude: int
) -> int:
    """The size of a coefficient of class `group` where about 2^(scaled / 256) is expected; -1 where it cannot be."""
    shift = (scale >> 8) - 3 if scale >= 1024 else 0
    place = (scale - shift * 256 + 7 * 256) * 4
    row, weight = place >> 8, place & 255
    if row > HAZARD_ROWS - 2:
        row, weight = HAZARD_ROWS - 2, 256
    row += HAZARD_ROWS * HAZARD_TABLE_OF[frequency_class]
    high, value = magnitude >> shift, 0
    while value < UNARY_DECISIONS:
        probability = (hazard[row, value] * (256 - weight) + hazard[row + 1, value] * weight) >> 8
        if not _code_bit(decoding, state, data, probability, 1 if high > value else 0):
            break
        value += 1
    if value == UNARY_DECISIONS:
        rest = high - UNARY_DECISIONS + 1
        bits, length = bit_length(rest) - 1 if not decoding else 0, 0
        while length < MAX_ESCAPE_BITS and _code_bit(
            decoding, state, data, HALF_PROBABILITY, 1 if bits > length else 0
        ):
            length += 1
        if length == MAX_ESCAPE_BITS:
            return -1
        value += (1 << length | _code_bits(decoding, state, data, length, rest)) - 1
    return value << shift | _code_bits(decoding, state, data, shift, magnitude)


@njit(cache=True)
def _code_coefficients(
    decoding: bool, state: IntArray, data: ByteArray, prior: Prior, q: IntArray, header: IntArray, duration_level: int
) -> bool:
    count, step = header[HEADER_FREQUENCIES], header[HEADER_STEP]
    seen = create_context_model(count)
    for channel in range(header[HEADER_CHANNELS]):
        axes = 1 if channel == 2 and header[HEADER_CHANNELS] == SCENE_CHANNEL_COUNT else 3
        for k in range(count):
            compute_shared_sums(prior, seen, channel, k, count, step, duration_level)
            for axis in range(axes):
                scaled = predict_scale(prior, seen, channel, axis, k)
                size = _code_magnitude(
                    decoding, state, data, prior.hazard, FREQUENCY_CLASS_OF[k], scaled, abs(q[channel, axis, k])
                )
                if size < 0:
                    return False
                if size > 0:
                    odds = prior.sign[FREQUENCY_CLASS_OF[k], sign_context(q, channel, axis, k)]
                    negative = _code_bit(decoding, state, data, odds, 1 if q[channel, axis, k] < 0 else 0)
                    q[channel, axis, k] = -size if negative else size
                update_magnitude(seen, channel, axis, k, size)
            finish_frequency(seen, channel, k)
        finish_channel(seen, channel, count)
    return True


@njit(cache=True, nogil=True)
def encode_block(
    prior: Prior, q: IntArray, header: IntArray, nominal_frames: int, duration_level: int, out: ByteArray
) -> int:
    """Write a block into `out`; the length, its first byte being of no use, or -1 where a coefficient is too large."""
    state = start_encoder()
    if not _code_header(False, state, out, nominal_frames, header) or not _code_coefficients(
        False, state, out, prior, q, header, duration_level
    ):
        return -1
    return finish_encoder(state, out)


@njit(cache=True)
def decode_header(data: ByteArray, nominal_frames: int, header: IntArray) -> bool:
    """Read the head alone; False where it cannot be one."""
    return _code_header(True, start_decoder(data), data, nominal_frames, header)


@njit(cache=True, nogil=True)
def decode_block(
    prior: Prior, data: ByteArray, q: IntArray, header: IntArray, nominal_frames: int, duration_level: int
) -> bool:
    """Read a block into `q`, zeros of (19, 3, count); False where it cannot be one."""
    state = start_decoder(data)
    return _code_header(True, state, data, nominal_frames, header) and _code_coefficients(
        True, state, data, prior, q, header, duration_level
    )


@njit(cache=True)
def collect_examples(
    prior: Prior,
    q: IntArray,
    header: IntArray,
    duration_level: int,
    features: IntArray,
    labels: IntArray,
    first_row: int,
) -> int:
    """For training: the `features` of every coefficient from row `first`, and in `where` its class, axis, size and sign
    (0 none, 1 plus, 2 minus) with its context; the row after the last."""
    count, row = header[HEADER_FREQUENCIES], first_row
    seen = create_context_model(count)
    for channel in range(header[HEADER_CHANNELS]):
        for k in range(count):
            compute_shared_sums(prior, seen, channel, k, count, header[HEADER_STEP], duration_level)
            for axis in range(3):
                predict_scale(prior, seen, channel, axis, k)
                features[row] = seen.features
                value = q[channel, axis, k]
                labels[row, 0], labels[row, 1], labels[row, 2] = FREQUENCY_CLASS_OF[k], 3 * channel + axis, abs(value)
                labels[row, 3] = 0 if value == 0 else 1 if value > 0 else 2
                labels[row, 4] = sign_context(q, channel, axis, k)
                row += 1
                update_magnitude(seen, channel, axis, k, abs(value))
            finish_frequency(seen, channel, k)
        finish_channel(seen, channel, count)
    return row


@njit(cache=True)
def allocate_output(q: IntArray) -> ByteArray:
    """Bytes enough for any block of these coefficients."""
    return np.zeros(64 + q.size * 10, dtype=np.uint8)
