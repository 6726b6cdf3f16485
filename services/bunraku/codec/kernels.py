"""The compiled inside of the codec: coefficients through contexts and prior into the range coder and back.

A module of its own because importing numba takes seconds: `coefficients` loads it at its first use, so that programs
which only pass blocks on start at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.coefficients import SCENE_CHANNELS
from bunraku.codec.contexts import (
    nothing_seen,
    scale,
    see,
    see_channel,
    see_frequency,
    share,
    sign_context,
)
from bunraku.codec.prior import CLASS_OF, HAZARD_OF, MOST_FRAMES, ROWS, UNARY, Integers, Prior
from bunraku.codec.rangecoder import EVEN, Bytes, decode_bit, encode_bit, finish, start_decoder, start_encoder

ESCAPE = 20
"""Bits of an escape's length, at most."""
_FRAMES_AS_USUAL = 32440
_MOST_FRAMES_BITS = 10

_ROOT_ALONE = 512
FRAMES, STEP, HEADING, COUNT, CHANNELS = range(5)
"""Places in a block's head: frames, step index, heading (-32..31), frequencies, and channels that are coded: 19, or 2
where all joints stand as their references; a scene's 3 are known beforehand, and its head says neither them nor a
heading."""


@njit(cache=True)
def _bit(decoding: bool, state: Integers, data: Bytes, probability: int, bit: int) -> int:
    if decoding:
        return decode_bit(state, data, probability)
    encode_bit(state, data, probability, bit)
    return bit


@njit(cache=True)
def _number(decoding: bool, state: Integers, data: Bytes, bits: int, value: int) -> int:
    result = 0
    for i in range(bits - 1, -1, -1):
        result = result << 1 | _bit(decoding, state, data, EVEN, (value >> i) & 1)
    return result


@njit(cache=True)
def bit_length(value: int) -> int:
    """Bits of a positive number."""
    bits = 0
    while value >> bits > 0:
        bits += 1
    return bits


@njit(cache=True)
def _head(decoding: bool, state: Integers, data: Bytes, usual: int, head: Integers) -> bool:
    """A block's head; False where it cannot be one."""
    if _bit(decoding, state, data, _FRAMES_AS_USUAL, 1 if head[FRAMES] == usual else 0):
        head[FRAMES] = usual
    else:
        head[FRAMES] = _number(decoding, state, data, _MOST_FRAMES_BITS, head[FRAMES])
    if not 1 <= head[FRAMES] <= MOST_FRAMES:
        return False
    scene = head[CHANNELS] == SCENE_CHANNELS
    if not scene:
        alone = _bit(decoding, state, data, _ROOT_ALONE, 1 if head[CHANNELS] == 2 else 0)
        head[CHANNELS] = 2 if alone else 19
    head[STEP] = _number(decoding, state, data, 8, head[STEP])
    if not scene:
        head[HEADING] = _number(decoding, state, data, 6, head[HEADING] + 32) - 32
    head[COUNT] = _number(decoding, state, data, bit_length(head[FRAMES]), head[COUNT])
    return head[COUNT] <= head[FRAMES]  # type: ignore[no-any-return]


@njit(cache=True)
def _size(decoding: bool, state: Integers, data: Bytes, hazard: Integers, group: int, scaled: int, size: int) -> int:
    """The size of a coefficient of class `group` where about 2^(scaled / 256) is expected; -1 where it cannot be."""
    shift = (scaled >> 8) - 3 if scaled >= 1024 else 0
    place = (scaled - shift * 256 + 7 * 256) * 4
    row, weight = place >> 8, place & 255
    if row > ROWS - 2:
        row, weight = ROWS - 2, 256
    row += ROWS * HAZARD_OF[group]
    high, value = size >> shift, 0
    while value < UNARY:
        probability = (hazard[row, value] * (256 - weight) + hazard[row + 1, value] * weight) >> 8
        if not _bit(decoding, state, data, probability, 1 if high > value else 0):
            break
        value += 1
    if value == UNARY:
        rest = high - UNARY + 1
        bits, length = bit_length(rest) - 1 if not decoding else 0, 0
        while length < ESCAPE and _bit(decoding, state, data, EVEN, 1 if bits > length else 0):
            length += 1
        if length == ESCAPE:
            return -1
        value += (1 << length | _number(decoding, state, data, length, rest)) - 1
    return value << shift | _number(decoding, state, data, shift, size)


@njit(cache=True)
def _body(decoding: bool, state: Integers, data: Bytes, prior: Prior, q: Integers, head: Integers, length: int) -> bool:
    count, step = head[COUNT], head[STEP]
    seen = nothing_seen(count)
    for channel in range(head[CHANNELS]):
        axes = 1 if channel == 2 and head[CHANNELS] == SCENE_CHANNELS else 3
        for k in range(count):
            share(prior, seen, channel, k, count, step, length)
            for axis in range(axes):
                scaled = scale(prior, seen, channel, axis, k)
                size = _size(decoding, state, data, prior.hazard, CLASS_OF[k], scaled, abs(q[channel, axis, k]))
                if size < 0:
                    return False
                if size > 0:
                    odds = prior.sign[CLASS_OF[k], sign_context(q, channel, axis, k)]
                    negative = _bit(decoding, state, data, odds, 1 if q[channel, axis, k] < 0 else 0)
                    q[channel, axis, k] = -size if negative else size
                see(seen, channel, axis, k, size)
            see_frequency(seen, channel, k)
        see_channel(seen, channel, count)
    return True


@njit(cache=True, nogil=True)
def encode(prior: Prior, q: Integers, head: Integers, usual: int, length: int, out: Bytes) -> int:
    """Write a block into `out`; the length, its first byte being of no use, or -1 where a coefficient is too large."""
    state = start_encoder()
    if not _head(False, state, out, usual, head) or not _body(False, state, out, prior, q, head, length):
        return -1
    return finish(state, out)


@njit(cache=True)
def decode_head(data: Bytes, usual: int, head: Integers) -> bool:
    """Read the head alone; False where it cannot be one."""
    return _head(True, start_decoder(data), data, usual, head)


@njit(cache=True, nogil=True)
def decode(prior: Prior, data: Bytes, q: Integers, head: Integers, usual: int, length: int) -> bool:
    """Read a block into `q`, zeros of (19, 3, count); False where it cannot be one."""
    state = start_decoder(data)
    return _head(True, state, data, usual, head) and _body(True, state, data, prior, q, head, length)


@njit(cache=True)
def examples(
    prior: Prior, q: Integers, head: Integers, length: int, features: Integers, where: Integers, first: int
) -> int:
    """For training: the `features` of every coefficient from row `first`, and in `where` its class, axis, size and sign
    (0 none, 1 plus, 2 minus) with its context; the row after the last."""
    count, row = head[COUNT], first
    seen = nothing_seen(count)
    for channel in range(head[CHANNELS]):
        for k in range(count):
            share(prior, seen, channel, k, count, head[STEP], length)
            for axis in range(3):
                scale(prior, seen, channel, axis, k)
                features[row] = seen.features
                value = q[channel, axis, k]
                where[row, 0], where[row, 1], where[row, 2] = CLASS_OF[k], 3 * channel + axis, abs(value)
                where[row, 3] = 0 if value == 0 else 1 if value > 0 else 2
                where[row, 4] = sign_context(q, channel, axis, k)
                row += 1
                see(seen, channel, axis, k, abs(value))
            see_frequency(seen, channel, k)
        see_channel(seen, channel, count)
    return row


@njit(cache=True)
def room(q: Integers) -> Bytes:
    """Bytes enough for any block of these coefficients."""
    return np.zeros(64 + q.size * 10, dtype=np.uint8)
