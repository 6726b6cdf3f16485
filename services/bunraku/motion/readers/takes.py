"""Choice of one motion of a file that has several."""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.motion.errors import UnreadableMotion, quote_excerpt

MAX_LISTED = 20
"""Names that a message lists."""


def choose_take(names: Sequence[str], sizes: Sequence[int], take: str | None) -> int:
    """Return the index of the motion called `take`, or of the largest if it is None; the first of equal ones.

    Raises `UnreadableMotion` if there is none.
    """
    if take is None:
        return max(range(len(names)), key=lambda index: (sizes[index], -index))
    if take not in names:
        raise UnreadableMotion(
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
