"""A few whole numbers to bytes and back (SPEC.md, Dancer), in plain Python: a service reads a dancer with every motion
that it opens, and must not wait seconds for the compiled coder to load.
"""

from __future__ import annotations

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import IntArray

INTEGER_BITS_LIMIT = 17
"""Bits of a number's size plus one, less one, are fewer."""
_HALF_PROBABILITY = 16384
_INITIAL_LENGTH_PROBABILITY = 22938
"""Odds of another bit before any number is seen, 0.7 in 1/32768."""
_TOP = 1 << 24


class _RangeEncoder:
    """The range coder of `rangecoder`, all that is written being one number."""

    def __init__(self) -> None:
        self._low, self._range, self._byte_count = 0, 0xFFFFFFFF, 4

    def code_bit(self, probability: int, bit: int) -> int:
        bound = (self._range >> 15) * probability
        if bit:
            self._range = bound
        else:
            self._low += bound
            self._range -= bound
        while self._range < _TOP:
            self._low, self._range, self._byte_count = self._low << 8, self._range << 8, self._byte_count + 1
        return bit

    def finish(self) -> bytes:
        for shift in (32, 24, 16, 8, 0):
            rounded = (self._low + (1 << shift) - 1) >> shift << shift
            if rounded < self._low + self._range:
                return rounded.to_bytes(self._byte_count, "big").rstrip(b"\0")
        raise AssertionError("the last interval holds a number")


class _RangeDecoder:
    """The range decoder; past the end of `data` come zeros."""

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
        while self._range < _TOP:
            byte = self._data[self._position] if self._position < len(self._data) else 0
            self._code, self._range, self._position = (
                (self._code << 8 | byte) & 0xFFFFFFFF,
                self._range << 8,
                self._position + 1,
            )
        return bit


def encode_integers(values: IntArray, model_groups: IntArray, mirror_of: IntArray) -> bytes:
    """Bytes of some whole numbers, each of a group with models of its own and perhaps with a twin before it, by its
    place; raises ValueError for one above 2^16."""
    coder = _RangeEncoder()
    if _code_integers(coder, [int(value) for value in values], model_groups, mirror_of, decoding=False) is None:
        raise ValueError("a number is too large to be coded")
    return coder.finish()


def decode_integers(data: bytes, model_groups: IntArray, mirror_of: IntArray) -> IntArray:
    """The numbers of `encode_numbers`; raises `DamagedBlock`."""
    values = _code_integers(_RangeDecoder(data), [0] * len(model_groups), model_groups, mirror_of, decoding=True)
    if values is None:
        raise DamagedBlock(f"a number is longer than {INTEGER_BITS_LIMIT} bits, or less than none")
    return np.array(values, dtype=np.int64)


def _code_integers(
    coder: _RangeEncoder | _RangeDecoder,
    values: list[int],
    model_groups: IntArray,
    mirror_of: IntArray,
    *,
    decoding: bool,
) -> list[int] | None:
    """Write `values`, or read them: of each its size, or what that differs from its twin's, then its sign, or whether
    that differs. None where a number cannot be."""
    lengths = [[_INITIAL_LENGTH_PROBABILITY] * INTEGER_BITS_LIMIT for _ in range(int(model_groups.max()) + 1)]
    signs = [[_HALF_PROBABILITY] for _ in lengths]

    def learned(model: list[int], at: int, bit: int) -> int:
        got = coder.code_bit(model[at], bit)
        model[at] = min(max(model[at] + ((32768 * got - model[at]) >> 3), 1024), 31744)
        return got

    for i, (group, twin) in enumerate(zip(model_groups.tolist(), mirror_of.tolist(), strict=True)):
        like = abs(values[twin]) if twin >= 0 else 0
        rest = abs(values[i]) - like
        bits, length = (abs(rest) + 1).bit_length() - 1, 0
        while length < INTEGER_BITS_LIMIT and learned(lengths[group], length, int(bits > length)):
            length += 1
        if length == INTEGER_BITS_LIMIT:
            return None
        size = 1
        for place in range(length - 1, -1, -1):
            size = size << 1 | coder.code_bit(_HALF_PROBABILITY, (abs(rest) + 1) >> place & 1)
        size -= 1
        if twin < 0:
            negative = bool(size) and bool(coder.code_bit(_HALF_PROBABILITY, int(values[i] < 0)))
        else:
            size = like - size if size and coder.code_bit(_HALF_PROBABILITY, int(rest < 0)) else like + size
            if size < 0:
                return None
            other = values[twin] < 0
            negative = other != (bool(size) and bool(learned(signs[group], 0, int((values[i] < 0) != other))))
        if decoding:
            values[i] = -size if negative else size
    return values
