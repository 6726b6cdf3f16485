"""Compiled kernels of the BVH reader: decimal numbers and word counts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from bunraku.motion.rotation import Array

ByteArray = npt.NDArray[np.uint8]


@njit(cache=True, nogil=True)
def parse_numbers(data: ByteArray, comma: int, powers: Array, out: Array) -> int:
    """Fill `out` with the numbers in `data`; return the byte where the first invalid word begins, or -1.

    A number is [+-]digits[.digits][e[+-]digits] with a digit before or after the point. Up to 15 significant digits
    and powers of ten within 22 the result is the nearest double (Clinger 1990), beyond that it is within a few units in
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


@njit(cache=True, nogil=True)
def count_words(data: ByteArray, comma: int, channel_count: int) -> tuple[int, int, int, int, int, int, int, int, int]:
    """Return the fields of `bvh_numbers.LineStatistics` for frames of `channel_count` values."""
    words = rows = matching = min_words = max_words = 0
    odd, odd_words, last, last_words = -1, 0, -1, 0
    line = count = 0
    between = True
    for c in data:
        space = c <= 32 or (comma == 2 and c == 44)
        if between and not space:
            if count == 0:
                if odd < 0 and last_words > 0 and last_words != channel_count:
                    odd, odd_words = last, last_words
                min_words = last_words if rows == 1 else min(min_words, last_words)
                rows += 1
            count += 1
        between = space
        if c == 10:
            if count > 0:
                words += count
                matching += count == channel_count
                max_words = max(max_words, count)
                last, last_words = line, count
            count = 0
            line += 1
    if count > 0:
        words += count
        matching += count == channel_count
        max_words = max(max_words, count)
        last, last_words = line, count
    min_words = last_words if rows <= 1 else min(min_words, last_words)
    return words, rows, matching, min_words, max_words, odd, odd_words, last, last_words
