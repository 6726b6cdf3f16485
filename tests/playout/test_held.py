from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.held import MOST, Held


@given(
    st.from_regex(r"[A-Za-z0-9]{1,64}", fullmatch=True),
    st.integers(0, 9_999_999),
    st.lists(st.integers(-1, 15), max_size=MOST),
    st.none() | st.integers(0, 16),
)
def test_it_is_read_as_it_was_said(motion: str, first: int, rates: list[int], tracks: int | None) -> None:
    held = Held(motion, first, tuple(rates), tracks)
    assert Held.read(held.text()) == held


def test_of_many_blocks_the_first_are_told() -> None:
    assert Held("m", 7, [2] * 100).text() == "m.7." + "2" * MOST


@pytest.mark.parametrize(
    "text", ["", "m", "m.1", "m.x.1", "../m.1.2", "m.1.g", "m.-1.2", "m.1." + "1" * 65, "m.1.2\n", "m.1.2.", "m.1.2.a"]
)
def test_anything_else_is_refused_in_words(text: str) -> None:
    with pytest.raises(ValueError, match=r"have=MOTION\.FIRST\.RATES"):
        Held.read(text)
