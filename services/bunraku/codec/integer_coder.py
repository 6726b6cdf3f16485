"""Adaptive coder of a few integers (proto/codec.md, 2.4), in plain Python.

A service parses a skeleton description for each motion that it opens, and must not wait seconds until the compiled
entropy coder is loaded.
"""

from __future__ import annotations

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import IntArray

INTEGER_BITS_LIMIT = 17
"""The bit length of a coded magnitude plus one, minus one, is below this."""
_HALF_PROBABILITY = 16384
_INITIAL_LENGTH_PROBABILITY = 22938
"""Initial probability of one more bit: 0.7, in 1/32768."""
_RENORMALISATION_LIMIT = 1 << 24


class _RangeEncoder:
    """The range encoder of `_kernels.range_coder`. All that it has written is one big integer."""

    def __init__(self) -> None:
        self._low, self._range, self._byte_count = 0, 0xFFFFFFFF, 4

    def code_bit(self, probability: int, bit: int) -> int:
        bound = (self._range >> 15) * probability
        if bit:
            self._range = bound
        else:
            self._low += bound
            self._range -= bound
        while self._range < _RENORMALISATION_LIMIT:
            self._low, self._range, self._byte_count = self._low << 8, self._range << 8, self._byte_count + 1
        return bit

    def finish(self) -> bytes:
        for shift in (32, 24, 16, 8, 0):
            rounded = (self._low + (1 << shift) - 1) >> shift << shift
            if rounded < self._low + self._range:
                return rounded.to_bytes(self._byte_count, "big").rstrip(b"\0")
        raise AssertionError("the last interval contains an integer")


class _RangeDecoder:
    """The range decoder of `_kernels.range_coder`. Past its end, `data` reads as zeros."""

    def __init__(self, data: bytes) -> None:
        self._data, self._position, self._range = data, 4, 0xFFFFFFFF
        self._code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")

    def code_bit(self, probability: int, _: int) -> int:
        bound = (self._range >> 15) * probability
        bit = int(self._code < bound)
        if bit:
            self._range = bound
        else:
            self._code -= bound
            self._range -= bound
        while self._range < _RENORMALISATION_LIMIT:
            byte = self._data[self._position] if self._position < len(self._data) else 0
            self._code, self._range, self._position = (
                (self._code << 8 | byte) & 0xFFFFFFFF,
                self._range << 8,
                self._position + 1,
            )
        return bit


def encode_integers(values: IntArray, model_groups: IntArray, mirror_of: IntArray) -> bytes:
    """Encode integers.

    Args:
        values: The integers.
        model_groups: Group of adaptive models of each integer.
        mirror_of: Index of the earlier integer that predicts each integer, or -1.

    Raises:
        ValueError: A magnitude exceeds 2^16.
    """
    coder = _RangeEncoder()
    if _code_integers(coder, [int(value) for value in values], model_groups, mirror_of, decoding=False) is None:
        raise ValueError("Cannot encode an integer: its magnitude is too large.")
    return coder.finish()


def decode_integers(data: bytes, model_groups: IntArray, mirror_of: IntArray) -> IntArray:
    """Decode the integers of `encode_integers`. Raises `DamagedBlock`."""
    values = _code_integers(_RangeDecoder(data), [0] * len(model_groups), model_groups, mirror_of, decoding=True)
    if values is None:
        raise DamagedBlock(
            f"Invalid description: an integer has {INTEGER_BITS_LIMIT} or more bits, or a negative magnitude."
        )
    return np.array(values, dtype=np.int64)


def _code_integers(
    coder: _RangeEncoder | _RangeDecoder,
    values: list[int],
    model_groups: IntArray,
    mirror_of: IntArray,
    *,
    decoding: bool,
) -> list[int] | None:
    """Write or read `values`; return None if one is invalid.

    Each integer is its magnitude, then its sign. A mirrored one is the difference of its magnitude from that of the
    earlier integer, then whether the signs differ.
    """
    lengths = [[_INITIAL_LENGTH_PROBABILITY] * INTEGER_BITS_LIMIT for _ in range(int(model_groups.max()) + 1)]
    signs = [[_HALF_PROBABILITY] for _ in lengths]

    def code_adaptive(model: list[int], index: int, bit: int) -> int:
        coded = coder.code_bit(model[index], bit)
        model[index] = min(max(model[index] + ((32768 * coded - model[index]) >> 3), 1024), 31744)
        return coded

    for i, (group, mirror) in enumerate(zip(model_groups.tolist(), mirror_of.tolist(), strict=True)):
        predicted = abs(values[mirror]) if mirror >= 0 else 0
        difference = abs(values[i]) - predicted
        bits, length = (abs(difference) + 1).bit_length() - 1, 0
        while length < INTEGER_BITS_LIMIT and code_adaptive(lengths[group], length, int(bits > length)):
            length += 1
        if length == INTEGER_BITS_LIMIT:
            return None
        magnitude = 1
        for position in range(length - 1, -1, -1):
            magnitude = magnitude << 1 | coder.code_bit(_HALF_PROBABILITY, (abs(difference) + 1) >> position & 1)
        magnitude -= 1
        if mirror < 0:
            negative = bool(magnitude) and bool(coder.code_bit(_HALF_PROBABILITY, int(values[i] < 0)))
        else:
            if magnitude and coder.code_bit(_HALF_PROBABILITY, int(difference < 0)):
                magnitude = -magnitude
            magnitude += predicted
            if magnitude < 0:
                return None
            mirror_negative = values[mirror] < 0
            differs = bool(magnitude) and bool(code_adaptive(signs[group], 0, int((values[i] < 0) != mirror_negative)))
            negative = mirror_negative != differs
        if decoding:
            values[i] = -magnitude if negative else magnitude
    return values
