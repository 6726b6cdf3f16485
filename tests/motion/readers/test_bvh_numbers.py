import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.readers.bvh_numbers import (
    DECIMAL_COMMA,
    NO_COMMA,
    SEPARATING_COMMA,
    LineStatistics,
    measure_lines,
    parse_numbers,
)


def parse_text(text: bytes, comma: int = NO_COMMA) -> tuple[list[float], int]:
    data = np.frombuffer(text, dtype=np.uint8)
    values, bad = parse_numbers(data, measure_lines(data, comma, 1).word_count, comma)
    return values.tolist(), bad


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=20))
def test_any_double_parses_within_its_last_digits(numbers: list[float]) -> None:
    values, bad = parse_text(b" ".join(repr(number).encode() for number in numbers))
    assert bad == -1
    assert values == pytest.approx(numbers, rel=1e-14, abs=1e-320)


@given(st.integers(-(10**15) + 1, 10**15 - 1), st.integers(0, 15))
def test_fifteen_digits_parse_exactly(digits: int, places: int) -> None:
    text = f"{digits}e-{places}"
    assert parse_text(text.encode())[0] == [float(text)]


@pytest.mark.parametrize(
    "word", ["", "-", ".", "1e", "1e+", "1.2.3", "1-2", "nan", "inf", "0x1", "1,5", "1e309", "1_0"]
)
def test_first_invalid_word_is_located(word: str) -> None:
    assert parse_text(b"1 2\n" + word.encode() + b" 3")[1] == (4 if word else -1)


def test_commas() -> None:
    assert parse_text(b"1,5 -,5", DECIMAL_COMMA)[0] == [1.5, -0.5]
    assert parse_text(b"1,5, 2", SEPARATING_COMMA)[0] == [1.0, 5.0, 2.0]


@given(st.lists(st.integers(0, 4), max_size=12), st.integers(1, 4))
def test_lines_are_counted(words: list[int], width: int) -> None:
    data = np.frombuffer(b"\n".join(b" ".join([b"7"] * number) for number in words), dtype=np.uint8)
    rows = [(line, number) for line, number in enumerate(words) if number]
    odd = next(((line, number) for line, number in rows[:-1] if number != width), (-1, 0))
    last = rows[-1] if rows else (-1, 0)
    counts = [number for _, number in rows] or [0]
    right = sum(number == width for _, number in rows)
    assert measure_lines(data, NO_COMMA, width) == LineStatistics(
        sum(words), len(rows), right, min(counts), max(counts), *odd, *last
    )
