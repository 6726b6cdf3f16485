"""A few whole numbers to bytes and back (SPEC.md, Dancer), in plain Python: a service reads a dancer with every motion
that it opens, and must not wait seconds for the compiled coder to load.
"""

from __future__ import annotations

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import Integers

NUMBER_BITS = 17
"""Bits of a number's size plus one, less one, are fewer."""
_EVEN = 16384
_LONGER = 22938
"""Odds of another bit before any number is seen, 0.7 in 1/32768."""
_TOP = 1 << 24


class _Writer:
    """The range coder of `rangecoder`, all that is written being one number."""

    def __init__(self) -> None:
        self._low, self._range, self._size = 0, 0xFFFFFFFF, 4

    def bit(self, probability: int, bit: int) -> int:
        bound = (self._range >> 15) * probability
        if bit:
            self._range = bound
        else:
            self._low += bound
            self._range -= bound
        while self._range < _TOP:
            self._low, self._range, self._size = self._low << 8, self._range << 8, self._size + 1
        return bit

    def finish(self) -> bytes:
        for shift in (32, 24, 16, 8, 0):
            rounded = (self._low + (1 << shift) - 1) >> shift << shift
            if rounded < self._low + self._range:
                return rounded.to_bytes(self._size, "big").rstrip(b"\0")
        raise AssertionError("the last interval holds a number")


class _Reader:
    """The range decoder; past the end of `data` come zeros."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at, self._range = data, 4, 0xFFFFFFFF
        self._code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")

    def bit(self, probability: int, _: int) -> int:
        bound = (self._range >> 15) * probability
        bit = int(self._code < bound)
        if bit:
            self._range = bound
        else:
            self._code -= bound
            self._range -= bound
        while self._range < _TOP:
            byte = self._data[self._at] if self._at < len(self._data) else 0
            self._code, self._range, self._at = (self._code << 8 | byte) & 0xFFFFFFFF, self._range << 8, self._at + 1
        return bit


def encode_numbers(values: Integers, groups: Integers, twins: Integers) -> bytes:
    """Bytes of some whole numbers, each of a group with models of its own and perhaps with a twin before it, by its
    place; raises ValueError for one above 2^16."""
    coder = _Writer()
    if _pass(coder, [int(value) for value in values], groups, twins, decoding=False) is None:
        raise ValueError("a number is too large to be coded")
    return coder.finish()


def decode_numbers(data: bytes, groups: Integers, twins: Integers) -> Integers:
    """The numbers of `encode_numbers`; raises `DamagedBlock`."""
    values = _pass(_Reader(data), [0] * len(groups), groups, twins, decoding=True)
    if values is None:
        raise DamagedBlock(f"a number is longer than {NUMBER_BITS} bits, or less than none")
    return np.array(values, dtype=np.int64)


def _pass(
    coder: _Writer | _Reader, values: list[int], groups: Integers, twins: Integers, *, decoding: bool
) -> list[int] | None:
    """Write `values`, or read them: of each its size, or what that differs from its twin's, then its sign, or whether
    that differs. None where a number cannot be."""
    lengths = [[_LONGER] * NUMBER_BITS for _ in range(int(groups.max()) + 1)]
    signs = [[_EVEN] for _ in lengths]

    def learned(model: list[int], at: int, bit: int) -> int:
        got = coder.bit(model[at], bit)
        model[at] = min(max(model[at] + ((32768 * got - model[at]) >> 3), 1024), 31744)
        return got

    for i, (group, twin) in enumerate(zip(groups.tolist(), twins.tolist(), strict=True)):
        like = abs(values[twin]) if twin >= 0 else 0
        rest = abs(values[i]) - like
        bits, length = (abs(rest) + 1).bit_length() - 1, 0
        while length < NUMBER_BITS and learned(lengths[group], length, int(bits > length)):
            length += 1
        if length == NUMBER_BITS:
            return None
        size = 1
        for place in range(length - 1, -1, -1):
            size = size << 1 | coder.bit(_EVEN, (abs(rest) + 1) >> place & 1)
        size -= 1
        if twin < 0:
            negative = bool(size) and bool(coder.bit(_EVEN, int(values[i] < 0)))
        else:
            size = like - size if size and coder.bit(_EVEN, int(rest < 0)) else like + size
            if size < 0:
                return None
            other = values[twin] < 0
            negative = other != (bool(size) and bool(learned(signs[group], 0, int((values[i] < 0) != other))))
        if decoding:
            values[i] = -size if negative else size
    return values
