"""Decimal numbers out of bytes, fast: a frame of motion capture is hundreds of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array

Bytes = npt.NDArray[np.uint8]
POWERS_OF_TEN: Array = np.array([float(f"1e{e}") for e in range(309)])
NO_COMMA, DECIMAL_COMMA, SEPARATING_COMMA = 0, 1, 2


def _parse_numbers(data: Bytes, comma: int, powers: Array, out: Array) -> int:
    """Fill `out` with the numbers in `data`; the byte where the first word begins that is no finite number, or -1.

    A number is [+-]digits[.digits][e[+-]digits] with a digit before or after the point. Up to 15 significant digits
    and powers of ten within 22 the result is the nearest double (Clinger 1990), beyond that within a few units in
    the last place: digits past the 18th are counted, not read.
    """
    length = len(data)
    position = 0
    word = 0
    while True:
        while position < length and (data[position] <= 32 or (comma == 2 and data[position] == 44)):
            position += 1
        if position >= length:
            return -1
        start = position
        negative = data[position] == 45
        if negative or data[position] == 43:
            position += 1
        mantissa = np.int64(0)
        kept = 0
        digits = 0
        exponent = 0
        point = False
        while position < length:
            c = data[position]
            if 48 <= c <= 57:
                digits += 1
                if kept < 18:
                    mantissa = mantissa * 10 + np.int64(c - 48)
                    if mantissa > 0:
                        kept += 1
                    if point:
                        exponent -= 1
                elif not point:
                    exponent += 1
            elif not point and (c == 46 or (comma == 1 and c == 44)):
                point = True
            else:
                break
            position += 1
        if digits == 0:
            return start
        if position < length and (data[position] == 101 or data[position] == 69):
            position += 1
            down = position < length and data[position] == 45
            if position < length and (data[position] == 45 or data[position] == 43):
                position += 1
            if position >= length or not 48 <= data[position] <= 57:
                return start
            power = 0
            while position < length and 48 <= data[position] <= 57:
                if power < 100_000:
                    power = power * 10 + int(data[position] - 48)
                position += 1
            exponent += -power if down else power
        if position < length and not (data[position] <= 32 or (comma == 2 and data[position] == 44)):
            return start
        value = float(mantissa)
        if mantissa != 0:
            if exponent > 308:
                return start
            if exponent >= 0:
                value *= powers[exponent]
            elif exponent >= -308:
                value /= powers[-exponent]
            else:
                value = value / 1e308 / powers[min(-exponent - 308, 308)]
            if value > 1.7976931348623157e308:
                return start
        out[word] = -value if negative else value
        word += 1


class LineStatistics(NamedTuple):
    """How words lie on the lines that have any: lines are counted from 0 where the data begins, -1 is none."""

    word_count: int
    """Words in all."""
    nonblank_lines: int
    """Lines that have any word."""
    matching_lines: int
    """Lines that have as many words as a frame has values."""
    min_words: int
    max_words: int
    first_mismatch: int
    """The first line, the last one apart, that has another number of words than a frame has values."""
    first_mismatch_words: int
    last_line: int
    last_line_words: int


def _count_words(data: Bytes, comma: int, channel_count: int) -> tuple[int, int, int, int, int, int, int, int, int]:
    """The fields of `Lines`, for frames of `width` values."""
    words = rows = right = fewest = most = 0
    odd, odd_words, last, last_words = -1, 0, -1, 0
    line = here = 0
    between = True
    for c in data:
        space = c <= 32 or (comma == 2 and c == 44)
        if between and not space:
            if here == 0:
                if odd < 0 and last_words > 0 and last_words != channel_count:
                    odd, odd_words = last, last_words
                fewest = last_words if rows == 1 else min(fewest, last_words)
                rows += 1
            here += 1
        between = space
        if c == 10:
            if here > 0:
                words += here
                right += here == channel_count
                most = max(most, here)
                last, last_words = line, here
            here = 0
            line += 1
    if here > 0:
        words += here
        right += here == channel_count
        most = max(most, here)
        last, last_words = line, here
    fewest = last_words if rows <= 1 else min(fewest, last_words)
    return words, rows, right, fewest, most, odd, odd_words, last, last_words


_parse_numbers_compiled: Callable[..., int] = numba.njit(cache=True, nogil=True)(_parse_numbers)
_count_words_compiled: Callable[..., tuple[int, ...]] = numba.njit(cache=True, nogil=True)(_count_words)


def parse_numbers(data: Bytes, count: int, comma: int) -> tuple[Array, int]:
    """The `count` numbers of `data`, and the byte where the first bad word begins (-1: there is none).

    `comma` says what a comma is: `NO_COMMA` (never right), `DECIMAL_COMMA` or `SEPARATING_COMMA`.
    """
    out = np.empty(count)
    bad = _parse_numbers_compiled(data, comma, POWERS_OF_TEN, out)
    return out, bad


def measure_lines(data: Bytes, comma: int, channel_count: int) -> LineStatistics:
    """How words lie on the lines of `data` (lines end in a line feed), for frames of `width` values."""
    return LineStatistics(*_count_words_compiled(data, comma, channel_count))
