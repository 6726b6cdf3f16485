"""Search columns of motions: name and tags in a folded form, which SQLite and PostgreSQL compare alike.

Neither database folds the case of all scripts by itself, and they differ in what they fold. The columns are therefore
folded here, when a row is written, and a search is folded in the same way.
"""

from __future__ import annotations

import unicodedata
from typing import Any

from bunraku.runtime.display_text import clean_text

TAG_SEPARATOR = "\n"
"""Separator before, between and after the tags of the column. No cleaned text contains it."""


def fold_text(text: str) -> str:
    """Return `text` for comparisons that ignore case and width: cleaned, case-folded, Normalization Form KC."""
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", clean_text(text)).casefold())


def fold_tag(tag: str) -> str:
    """Return a tag as it occurs in the column of folded tags."""
    return f"{TAG_SEPARATOR}{fold_text(tag)}{TAG_SEPARATOR}"


def search_columns(description: dict[str, Any]) -> dict[str, str]:
    """Return the search columns of a motion's row."""
    folded_tags = [fold_text(str(tag)) for tag in description.get("tags") or []]
    return {
        "folded_name": fold_text(str(description.get("name") or "")),
        "folded_tags": TAG_SEPARATOR.join(["", *folded_tags, ""]) if folded_tags else "",
    }
