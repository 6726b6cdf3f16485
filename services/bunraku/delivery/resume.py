"""Blocks that a reconnecting viewer still holds, as sent in the `have` parameter (proto/server.md, 6.1)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.wire.limbs import MAX_PERFORMERS

MAX_BLOCKS = 64
"""Blocks that are listed for each performer."""
_PATTERN = re.compile(
    r"([A-Za-z0-9]{1,64})\.([0-9]{1,7})\.([0-9a-f-]{0,64})"
    rf"(?:\.([0-9]{{1,2}})((?:\.[0-9]{{1,7}}\.[0-9a-z-]{{0,64}}){{0,{MAX_PERFORMERS - 1}}}))?"
)
_RUN = re.compile(r"(.)\1{1,20}")
_DIGITS = "-0123456789abcdef"

HeldBlocks = tuple[int, Sequence[int]]
"""Held blocks of one performer: index of the first, and the levels from there on, wrapping at the end; -1 for none."""


@dataclass(frozen=True, slots=True)
class ResumeState:
    """Parts of a motion that a viewer holds."""

    motion: str
    first: int
    """Index of the first listed block of the first performer."""
    levels: Sequence[int]
    """Levels of the first performer's blocks, as in `HeldBlocks`."""
    track_count: int | None = None
    """Number of tracks whose description the viewer holds; None for all."""
    other_performers: Sequence[HeldBlocks] = ()
    """Blocks of the other performers; sent only with `track_count`."""

    def to_query(self) -> str:
        """Return the value of the `have` parameter."""
        text = f"{self.motion}.{self.first}.{_format_levels(self.levels)}"
        if self.track_count is None:
            return text
        # the first performer has no run lengths, since servers without support for several performers parse it
        others = (
            f".{first}.{_RUN.sub(_shorten_run, _format_levels(levels))}" for first, levels in self.other_performers
        )
        return f"{text}.{self.track_count}{''.join(others)}"

    @property
    def performers(self) -> list[HeldBlocks]:
        """Held blocks of each performer, in order."""
        return [(self.first, self.levels), *self.other_performers]

    @classmethod
    def parse(cls, text: str) -> ResumeState:
        """Parse the value of the `have` parameter; raise ValueError if it is malformed."""
        found = _PATTERN.fullmatch(text)
        if found is None:
            raise ValueError(_FORMAT_ERROR)
        parts = (found[5] or "").split(".")[1:]
        others = tuple((int(first), _parse_levels(runs)) for first, runs in zip(parts[::2], parts[1::2], strict=True))
        return cls(found[1], int(found[2]), _parse_levels(found[3]), int(found[4]) if found[4] else None, others)


_FORMAT_ERROR = (
    "Malformed parameter; expected have=MOTION.FIRST.RATES.TRACKS: an id, the index of a block, one hexadecimal digit "
    f"or - for that block and each one after it (at most {MAX_BLOCKS}), and the number of described tracks; then "
    f".FIRST.RATES of each further performer (at most {MAX_PERFORMERS - 1}), where a letter from g to z repeats the "
    "digit before it 1 to 20 times"
)


def _format_levels(levels: Sequence[int]) -> str:
    return "".join(_DIGITS[level + 1] for level in levels[:MAX_BLOCKS])


def _shorten_run(run: re.Match[str]) -> str:
    return run[1] + chr(ord("f") + len(run[0]) - 1)


def _parse_levels(text: str) -> tuple[int, ...]:
    """Parse digits, and letters that repeat the digit before them; raise ValueError."""
    levels: list[int] = []
    for character in text:
        if character in _DIGITS:
            levels.append(_DIGITS.index(character) - 1)
        elif levels:
            levels += levels[-1:] * (ord(character) - ord("f"))
        if not 0 < len(levels) <= MAX_BLOCKS:
            raise ValueError(_FORMAT_ERROR)
    return tuple(levels)
