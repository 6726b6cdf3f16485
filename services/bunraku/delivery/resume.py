"""What a viewer who comes back already holds of a motion, as it says in the URL (SPEC.md, Sockets: `have`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.wire.limbs import MAX_PERFORMERS

MAX_BLOCKS = 64
"""Blocks of each performer that may be told of."""
_PATTERN = re.compile(
    r"([A-Za-z0-9]{1,64})\.([0-9]{1,7})\.([0-9a-f-]{0,64})"
    rf"(?:\.([0-9]{{1,2}})((?:\.[0-9]{{1,7}}\.[0-9a-z-]{{0,64}}){{0,{MAX_PERFORMERS - 1}}}))?"
)
_RUN = re.compile(r"(.)\1{1,20}")
_DIGITS = "-0123456789abcdef"

HeldBlocks = tuple[int, Sequence[int]]
"""Of one performer: the index of a block, and from that one on, around the end, the rates held, -1 for none."""


@dataclass(frozen=True, slots=True)
class ResumeState:
    """The Description of `motion`, of its first `tracks` or, None, of all; `first` and `rates` are the first
    performer's `Blocks`, `others` those of the next ones, which are told only where `tracks` is."""

    motion: str
    first: int
    levels: Sequence[int]
    track_count: int | None = None
    other_performers: Sequence[HeldBlocks] = ()

    def to_query(self) -> str:
        """As it stands in a URL."""
        text = f"{self.motion}.{self.first}.{_format_levels(self.levels)}"
        if self.track_count is None:
            return text
        # of the first all digits: servers that know of no others read that
        others = (f".{first}.{_RUN.sub(_shorten_run, _format_levels(rates))}" for first, rates in self.other_performers)
        return f"{text}.{self.track_count}{''.join(others)}"

    @property
    def performers(self) -> list[HeldBlocks]:
        """Of each performer, the first first, what is held."""
        return [(self.first, self.levels), *self.other_performers]

    @classmethod
    def parse(cls, text: str) -> ResumeState:
        """What `text` says; raises ValueError where it is not of this form."""
        found = _PATTERN.fullmatch(text)
        if found is None:
            raise ValueError(_FORMAT_ERROR)
        said = (found[5] or "").split(".")[1:]
        others = tuple((int(first), _parse_levels(runs)) for first, runs in zip(said[::2], said[1::2], strict=True))
        return cls(found[1], int(found[2]), _parse_levels(found[3]), int(found[4]) if found[4] else None, others)


_FORMAT_ERROR = (
    "have=MOTION.FIRST.RATES.TRACKS: an id, a block's index, a hexadecimal digit or - for that block and for each "
    f"after it, {MAX_BLOCKS} at most, and how many tracks were told of; then .FIRST.RATES of each performer behind the "
    f"first, {MAX_PERFORMERS - 1} at most, where a letter from g to z repeats the digit before it 1 to 20 times"
)


def _format_levels(levels: Sequence[int]) -> str:
    return "".join(_DIGITS[rate + 1] for rate in levels[:MAX_BLOCKS])


def _shorten_run(run: re.Match[str]) -> str:
    return run[1] + chr(ord("f") + len(run[0]) - 1)


def _parse_levels(text: str) -> tuple[int, ...]:
    """What digits, and letters that repeat them, say; raises ValueError."""
    rates: list[int] = []
    for sign in text:
        if sign in _DIGITS:
            rates.append(_DIGITS.index(sign) - 1)
        elif rates:
            rates += rates[-1:] * (ord(sign) - ord("f"))
        if not 0 < len(rates) <= MAX_BLOCKS:
            raise ValueError(_FORMAT_ERROR)
    return tuple(rates)
