"""The compiled inside of the codec: coefficients through adaptive contexts into the range coder and back.

A module of its own because importing numba takes seconds: `coefficients` loads it at its first use, so that programs
which only pass blocks on start at once. Coefficients are int64 (19, 3, K): channel, axis, frequency.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.codec.rangecoder import (
    EVEN,
    Bytes,
    Integers,
    decode_bit,
    encode_bit,
    finish,
    start_decoder,
    start_encoder,
)

FREQUENCY_BITS = 10
UNARY = 14
ESCAPE = 24

# models lie in one array: unary [class 3][position 4][neighbourhood 6][14], then Exp-Golomb [class 3][2][24];
# row 0 is the probability, row 1 how many bits the model has seen
_UNARY_MODELS = 3 * 4 * 6 * UNARY
_MODELS = _UNARY_MODELS + 3 * 2 * ESCAPE
_NEIGHBOURHOOD_START = np.array([4274, 10923, 16384, 21845, 26214, 29789], dtype=np.int64)
_ESCAPE_START = 26214


@njit(cache=True)
def _fresh_models() -> Integers:
    models = np.zeros((2, _MODELS), dtype=np.int64)
    for which in range(_UNARY_MODELS):
        models[0, which] = _NEIGHBOURHOOD_START[which // UNARY % 6]
    models[0, _UNARY_MODELS:] = _ESCAPE_START
    return models


@njit(cache=True)
def _adaptive(decoding: bool, state: Integers, data: Bytes, models: Integers, which: int, bit: int) -> int:
    probability = models[0, which]
    if decoding:
        bit = decode_bit(state, data, probability)
    else:
        encode_bit(state, data, probability, bit)
    goal = 32768 if bit else 0
    probability += (goal - probability) >> min(2 + (models[1, which] >> 1), 5)
    models[0, which] = min(max(probability, 64), 32704)
    models[1, which] += 1
    return bit


@njit(cache=True)
def _even(decoding: bool, state: Integers, data: Bytes, bit: int) -> int:
    if decoding:
        return decode_bit(state, data, EVEN)
    encode_bit(state, data, EVEN, bit)
    return bit


@njit(cache=True)
def _exp_golomb(decoding: bool, state: Integers, data: Bytes, models: Integers, first: int, rest: int) -> int:
    """The value, or -1 where the escape is longer than it may be."""
    bits = 0
    if not decoding:
        while (rest + 1) >> (bits + 1) > 0:
            bits += 1
    length = 0
    while length < ESCAPE and _adaptive(decoding, state, data, models, first + length, 1 if bits > length else 0):
        length += 1
    if length == ESCAPE:
        return -1
    value = 1
    for i in range(length - 1, -1, -1):
        value = (value << 1) | _even(decoding, state, data, ((rest + 1) >> i) & 1)
    return value - 1


@njit(cache=True)
def _code(decoding: bool, state: Integers, data: Bytes, models: Integers, q: Integers) -> bool:
    """Encode `q` or decode into it; False where the data cannot be a block."""
    for channel in range(q.shape[0]):
        group = min(channel, 2)
        golomb = _UNARY_MODELS + group * 2 * ESCAPE
        for axis in range(3):
            for k in range(q.shape[2]):
                size = abs(q[channel, axis, k])
                if k == 0:
                    value = _exp_golomb(decoding, state, data, models, golomb, size)
                    if value < 0:
                        return False
                else:
                    near = 2 * abs(q[channel, axis, k - 1])
                    if k > 1:
                        near += abs(q[channel, axis, k - 2])
                    if axis > 0:
                        near += abs(q[channel, axis - 1, k])
                    neighbourhood = 0
                    while neighbourhood < 5 and near > (1 << neighbourhood) - (neighbourhood == 0):
                        neighbourhood += 1
                    position = 0 if k == 1 else 1 if k < 4 else 2 if k < 8 else 3
                    first = ((group * 4 + position) * 6 + neighbourhood) * UNARY
                    value = 0
                    while value < UNARY and _adaptive(
                        decoding, state, data, models, first + value, 1 if size > value else 0
                    ):
                        value += 1
                    if value == UNARY:
                        rest = _exp_golomb(decoding, state, data, models, golomb + ESCAPE, size - UNARY)
                        if rest < 0:
                            return False
                        value += rest
                if value > 0:
                    negative = _even(decoding, state, data, 1 if q[channel, axis, k] < 0 else 0)
                    if decoding:
                        q[channel, axis, k] = -value if negative else value
    return True


@njit(cache=True)
def encode(q: Integers, out: Bytes) -> int:
    """Write `q` into `out`; the length, its first byte being of no use, or -1 where a coefficient is too large."""
    state = start_encoder()
    for i in range(FREQUENCY_BITS - 1, -1, -1):
        encode_bit(state, out, EVEN, (q.shape[2] >> i) & 1)
    if not _code(False, state, out, _fresh_models(), q):
        return -1
    return finish(state, out)


@njit(cache=True)
def decode(data: Bytes, q: Integers) -> int:
    """Read `data` into `q`, which is zero; how many frequencies it has, -1 where it cannot be a block. Where there are
    more than `q` has room for nothing is read."""
    state = start_decoder(data)
    count = 0
    for _ in range(FREQUENCY_BITS):
        count = count << 1 | decode_bit(state, data, EVEN)
    if count <= q.shape[2] and not _code(True, state, data, _fresh_models(), q[:, :, :count]):
        return -1
    return count
