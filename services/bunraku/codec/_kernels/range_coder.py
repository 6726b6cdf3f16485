"""Binary range coder with carry, in integers (Martin 1979; the carry as in LZMA).

proto/codec.md, 2.1, is the definition; the TypeScript client runs the same arithmetic and must reach the same bits.
The state of a coder is one int64 array: LOW, RANGE, CACHE, PENDING, POSITION. A decoder keeps its code in LOW.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from bunraku.codec.prior import IntArray

ByteArray = npt.NDArray[np.uint8]

HALF_PROBABILITY = 16384
"""Probability of one half, in 1/32768."""

_LOW, _RANGE, _CACHE, _PENDING, _POSITION = range(5)
_RENORMALISATION_LIMIT = 1 << 24
_INITIAL_RANGE = 0xFFFFFFFF


@njit(cache=True)
def start_encoder() -> IntArray:
    """Return the state of a new encoder."""
    return np.array([0, _INITIAL_RANGE, 0, 1, 0], dtype=np.int64)


@njit(cache=True)
def start_decoder(data: ByteArray) -> IntArray:
    """Return the state of a decoder at the start of `data`, from which the first byte (always zero) is left out."""
    state = np.array([0, _INITIAL_RANGE, 0, 0, 4], dtype=np.int64)
    for i in range(4):
        state[_LOW] = (state[_LOW] << 8) | (data[i] if i < len(data) else 0)
    return state


@njit(cache=True)
def _shift_low(state: IntArray, out: ByteArray) -> None:
    """Write the highest byte of LOW. A byte that a carry may still change stays pending."""
    if state[_LOW] < 0xFF000000 or state[_LOW] > _INITIAL_RANGE:
        carry = state[_LOW] >> 32
        while state[_PENDING] > 0:
            out[state[_POSITION]] = (state[_CACHE] + carry) & 255
            state[_POSITION] += 1
            state[_CACHE] = 255
            state[_PENDING] -= 1
        state[_CACHE] = (state[_LOW] >> 24) & 255
    state[_PENDING] += 1
    state[_LOW] = (state[_LOW] << 8) & _INITIAL_RANGE


@njit(cache=True)
def encode_bit(state: IntArray, out: ByteArray, probability: int, bit: int) -> None:
    """Write `bit` (0 or 1) into `out`, which must be large enough. `probability` is that of a 1, in 1/32768."""
    bound = (state[_RANGE] >> 15) * probability
    if bit:
        state[_RANGE] = bound
    else:
        state[_LOW] += bound
        state[_RANGE] -= bound
    while state[_RANGE] < _RENORMALISATION_LIMIT:
        _shift_low(state, out)
        state[_RANGE] <<= 8


@njit(cache=True)
def decode_bit(state: IntArray, data: ByteArray, probability: int) -> int:
    """Read a bit that was written with the same `probability`. Past its end, `data` reads as zeros."""
    bound = (state[_RANGE] >> 15) * probability
    if state[_LOW] < bound:
        state[_RANGE] = bound
        bit = 1
    else:
        state[_LOW] -= bound
        state[_RANGE] -= bound
        bit = 0
    while state[_RANGE] < _RENORMALISATION_LIMIT:
        byte = data[state[_POSITION]] if state[_POSITION] < len(data) else 0
        state[_LOW] = ((state[_LOW] << 8) | byte) & _INITIAL_RANGE
        state[_RANGE] <<= 8
        state[_POSITION] += 1
    return bit


@njit(cache=True)
def finish_encoder(state: IntArray, out: ByteArray) -> int:
    """End the stream and return the number of bytes written.

    The stream ends with the number of the last interval that has the most trailing zero bytes. The first byte is always
    zero; like trailing zeros, it need not be sent.
    """
    high = state[_LOW] + state[_RANGE] - 1
    for shift in (32, 24, 16, 8, 0):
        rounded = (state[_LOW] + (1 << shift) - 1) >> shift << shift
        if rounded <= high:
            state[_LOW] = rounded
            break
    for _ in range(5):
        _shift_low(state, out)
    return int(state[_POSITION])
