from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.storage.cursor import parse_cursor, write_cursor
from bunraku.storage.record import InvalidCursor


@given(st.integers(0, (1 << 63) - 1), st.text("abcdefghij234567", min_size=1, max_size=32))
def test_cursor_gives_its_row(created: int, row_id: str) -> None:
    assert parse_cursor(write_cursor(created, row_id)) == (created, row_id)


@pytest.mark.parametrize("cursor", ["", "x", "YQ==", "\N{BULLET}", write_cursor(1, "a;b"), write_cursor(1, "")])
def test_other_texts_are_refused(cursor: str) -> None:
    with pytest.raises(InvalidCursor):
        parse_cursor(cursor)
