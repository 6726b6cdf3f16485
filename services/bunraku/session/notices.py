"""Why inputs were not taken as they came, said quietly: once a second for each reason and limb (SPEC.md, Notice)."""

from __future__ import annotations

from bunraku.wire.limbs import LIMBS, MOST_LIMBS
from bunraku.wire.messages import Notice

EVERY = 1_000_000
"""Microseconds between two notices of one kind about one limb."""
RATE = 320
"""Messages a second that a puppeteer may send: four limbs at the rate of a screen, and what goes with them."""

_DETAILS = {
    "reach": "the {limb} was asked to a place out of reach and goes as near as it can",
    "owner": "the {limb} is not yours: an input for it was refused",
    "rate": f"more than {RATE} messages came in a second: an input for the {{limb}} was dropped",
}


_NAMES = [
    LIMBS[limb % len(LIMBS)].replace("_", " ") + (f" of dancer {limb // len(LIMBS) + 1}" if limb >= len(LIMBS) else "")
    for limb in range(MOST_LIMBS)
]


class Notices:
    """Those to one puppeteer."""

    def __init__(self) -> None:
        self._said: dict[tuple[int, str], int] = {}

    def due(self, limb: int, reason: str, now: int) -> bytes | None:
        """The message, None where the same was said within the last second; `now` in microseconds."""
        last = self._said.get((limb, reason))
        if last is not None and now - last < EVERY:
            return None
        self._said[limb, reason] = now
        return Notice(limb, reason, _DETAILS[reason].format(limb=_NAMES[limb])).pack()
