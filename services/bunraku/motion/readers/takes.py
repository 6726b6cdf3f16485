"""Names of the motions of a file that has several, and the choice of one of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bunraku.motion.errors import UnreadableFile, quote_excerpt

MAX_NAME_CHARACTERS = 200
"""Characters of a name beyond which it is cut."""
MAX_LISTED = 20
"""Names that a message lists."""
_UNSTORABLE = re.compile("[\x00-\x1f\x7f\ud800-\udfff]")


@dataclass(frozen=True, slots=True)
class TakeList:
    """First names of the motions of a file, each of which `read_motion` accepts as a take, and the number of all."""

    names: list[str]
    count: int


def name_takes(names: Iterable[str]) -> list[str]:
    """Return names that are unique, short and without control characters: a second "walk" becomes "walk (2)"."""
    found: dict[str, None] = {}
    used: dict[str, int] = {}
    for name in names:
        base = unique = _UNSTORABLE.sub("\ufffd", name[:MAX_NAME_CHARACTERS])
        while unique in found:
            used[base] = used.get(base, 1) + 1
            unique = f"{base} ({used[base]})"
        found[unique] = None
    return list(found)


def choose_take(names: Sequence[str], sizes: Sequence[int], take: str | None) -> int:
    """Return the index of the motion called `take`, or of the largest if it is None; the first of equal ones.

    Raises `UnreadableFile` if there is none.
    """
    if take is None:
        return max(range(len(names)), key=lambda index: (sizes[index], -index))
    if take not in names:
        raise UnreadableFile(
            "No such take", f"there is no take {quote_excerpt(take)}", field="take", hint=f"the file has {_list(names)}"
        )
    return names.index(take)


def describe_choice(names: Sequence[str], chosen: int) -> list[str]:
    """Return a sentence about the motions that were not read, none if there are none."""
    others = [name for index, name in enumerate(names) if index != chosen]
    if not others:
        return []
    return [f"Of {len(names)} takes, {quote_excerpt(names[chosen])} was read; the others are {_list(others)}."]


def _list(names: Sequence[str]) -> str:
    listed = ", ".join(quote_excerpt(name) for name in names[:MAX_LISTED])
    return listed if len(names) <= MAX_LISTED else f"{listed} and {len(names) - MAX_LISTED} more"
