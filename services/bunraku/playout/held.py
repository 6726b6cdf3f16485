"""What a viewer who comes back already holds of a motion, as it says in the URL (SPEC.md, Sockets: `have`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

MOST = 64
"""Blocks that may be told of."""
_FORM = re.compile(r"([A-Za-z0-9]{1,64})\.([0-9]{1,7})\.([0-9a-f-]{0,64})(?:\.([0-9]{1,2}))?")


@dataclass(frozen=True, slots=True)
class Held:
    """The Description of `motion`, of its first `tracks` or, None, of all; and of its own track's blocks from `first`
    on the rates held, -1 for none."""

    motion: str
    first: int
    rates: Sequence[int]
    tracks: int | None = None

    def text(self) -> str:
        """As it stands in a URL."""
        digits = "".join("-" if rate < 0 else f"{rate:x}" for rate in self.rates[:MOST])
        return f"{self.motion}.{self.first}.{digits}" + ("" if self.tracks is None else f".{self.tracks}")

    @classmethod
    def read(cls, text: str) -> Held:
        """What `text` says; raises ValueError where it is not of this form."""
        found = _FORM.fullmatch(text)
        if found is None:
            raise ValueError(
                "have=MOTION.FIRST.RATES.TRACKS: an id, a block's index, a hexadecimal digit or - for that block and "
                f"for each after it, {MOST} at most, and how many tracks were told of"
            )
        rates = tuple(-1 if digit == "-" else int(digit, 16) for digit in found[3])
        return cls(found[1], int(found[2]), rates, int(found[4]) if found[4] else None)
