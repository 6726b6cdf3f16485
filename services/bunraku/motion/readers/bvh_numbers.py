"""Fast parsing of decimal numbers in bytes: a frame of motion capture has hundreds of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.kernels import load_kernels
from bunraku.motion.rotation import Array

ByteArray = npt.NDArray[np.uint8]
POWERS_OF_TEN: Array = np.array([float(f"1e{e}") for e in range(309)])
NO_COMMA, DECIMAL_COMMA, SEPARATING_COMMA = 0, 1, 2


class LineStatistics(NamedTuple):
    """Distribution of words over the lines that have any; lines count from 0 at the start of the data, -1 is none."""

    word_count: int
    """Words in total."""
    nonblank_lines: int
    """Lines with at least one word."""
    matching_lines: int
    """Lines with as many words as a frame has values."""
    min_words: int
    max_words: int
    first_mismatch: int
    """First line, except the last one, with another number of words than a frame has values."""
    first_mismatch_words: int
    last_line: int
    last_line_words: int


def parse_numbers(data: ByteArray, count: int, comma: int) -> tuple[Array, int]:
    """Parse the `count` numbers of `data`; return them and the byte where the first invalid word begins (-1: none).

    `comma` is the role of commas: `NO_COMMA` (invalid), `DECIMAL_COMMA` or `SEPARATING_COMMA`.
    """
    out = np.empty(count)
    bad: int = load_kernels("motion.readers").parse_numbers(data, comma, POWERS_OF_TEN, out)
    return out, bad


def measure_lines(data: ByteArray, comma: int, channel_count: int) -> LineStatistics:
    """Return the distribution of words in `data` (line feeds) for frames of `channel_count` values."""
    return LineStatistics(*load_kernels("motion.readers").count_words(data, comma, channel_count))
