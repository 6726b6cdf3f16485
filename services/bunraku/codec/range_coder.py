"""A binary range coder with carry and adaptive bit models, in integers only (Martin 1979; the carry as in LZMA).

SPEC.md "Motion block" is the definition; the TypeScript client runs the same arithmetic and must reach the same bits.
The coder's state is one int64 array so that compiled code can pass it on: LOW, RANGE, CACHE, PENDING, POSITION.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

IntArray = npt.NDArray[np.int64]
ByteArray = npt.NDArray[np.uint8]

HALF_PROBABILITY = 16384
"""Probability of one half, in 1/32768."""

_LOW, _RANGE, _CACHE, _PENDING, _POSITION = range(5)
_TOP = 1 << 24
_INITIAL_RANGE = 0xFFFFFFFF


@njit(cache=True)
def start_encoder() -> IntArray:
    """A fresh encoder state."""
    return np.array([0, _INITIAL_RANGE, 0, 1, 0], dtype=np.int64)


@njit(cache=True)
def start_decoder(data: ByteArray) -> IntArray:
    """A decoder state at the start of `data`, whose first byte (always zero) was left out."""
    state = np.array([0, _INITIAL_RANGE, 0, 0, 4], dtype=np.int64)
    for i in range(4):
        state[_LOW] = (state[_LOW] << 8) | (data[i] if i < len(data) else 0)
    return state


@njit(cache=True)
def _shift_low(state: IntArray, out: ByteArray) -> None:
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
    """Write `bit` (0 or 1), a 1 having `probability` / 32768, into `out` (uint8, large enough)."""
    bound = (state[_RANGE] >> 15) * probability
    if bit:
        state[_RANGE] = bound
    else:
        state[_LOW] += bound
        state[_RANGE] -= bound
    while state[_RANGE] < _TOP:
        _shift_low(state, out)
        state[_RANGE] <<= 8


@njit(cache=True)
def decode_bit(state: IntArray, data: ByteArray, probability: int) -> int:
    """Read a bit that was written with the same `probability`; past the end of `data` come zeros."""
    bound = (state[_RANGE] >> 15) * probability
    if state[_LOW] < bound:
        state[_RANGE] = bound
        bit = 1
    else:
        state[_LOW] -= bound
        state[_RANGE] -= bound
        bit = 0
    while state[_RANGE] < _TOP:
        byte = data[state[_POSITION]] if state[_POSITION] < len(data) else 0
        state[_LOW] = ((state[_LOW] << 8) | byte) & _INITIAL_RANGE
        state[_RANGE] <<= 8
        state[_POSITION] += 1
    return bit


@njit(cache=True)
def finish_encoder(state: IntArray, out: ByteArray) -> int:
    """End the stream with the number within the last interval that has the most zero bytes at its end; the bytes
    written. The first is always zero and, like zeros at the end, need not be sent."""
    high = state[_LOW] + state[_RANGE] - 1
    for shift in (32, 24, 16, 8, 0):
        rounded = (state[_LOW] + (1 << shift) - 1) >> shift << shift
        if rounded <= high:
            state[_LOW] = rounded
            break
    for _ in range(5):
        _shift_low(state, out)
    return int(state[_POSITION])
