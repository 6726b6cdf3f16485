from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.storage.search_text import fold_tag, fold_text, search_columns


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Straße", "STRASSE"),
        ("ÉTÉ", "e\u0301te\u0301"),
        ("ＫＲＡＮＩＣＨ", "kranich"),
        ("ΣΊΣΥΦΟΣ", "σίσυφος"),
        ("ＡＢ　Ｃ", "ab c"),
        ("a\u200b\x1b[31mb", "AB"),
    ],
)
def test_texts_that_differ_in_case_or_width_fold_alike(one: str, other: str) -> None:
    assert fold_text(one) == fold_text(other)


@given(st.text())
def test_folded_text_has_one_line_and_ignores_case(text: str) -> None:
    assert "\n" not in fold_text(text)
    assert fold_text(text.casefold()) == fold_text(text) or len(text.casefold()) != len(text)


def test_columns_hold_the_folded_name_and_tags() -> None:
    columns = search_columns({"name": "Crane", "tags": ["One", "Zwei Drei"]})
    assert columns == {"folded_name": "crane", "folded_tags": "\none\nzwei drei\n"}
    assert fold_tag("ZWEI drei") in columns["folded_tags"]
    assert search_columns({}) == {"folded_name": "", "folded_tags": ""}
