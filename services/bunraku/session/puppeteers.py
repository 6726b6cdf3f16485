"""Who pulls at a stage: what is still to be said to each, and how much each may say."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from bunraku.wire.messages import LIMBS, Notice

QUEUE = 64
"""Messages that may wait for a puppeteer."""
COLOURS = 5
MOST = 32
"""Puppeteers of one session."""
RATE = 320
"""Messages a second that a puppeteer may send: four limbs at the rate of a screen, and what goes with them."""
NOTICE_EVERY = 1_000_000
"""Microseconds between two notices of one kind about one limb."""

_DETAILS = {
    "reach": "the {limb} was asked to a place out of reach and goes as near as it can",
    "owner": "the {limb} is not yours: an input for it was refused",
    "rate": f"more than {RATE} messages came in a second: an input for the {{limb}} was dropped",
}


class Full(Exception):
    """A session that has as many puppeteers as it may."""


@dataclass(eq=False, slots=True)
class Puppeteer:
    """One who may take limbs, and what is still to be said to them."""

    id: str
    name: str
    colour: int
    waiting: deque[bytes] = field(default_factory=deque)
    wake: asyncio.Event = field(default_factory=asyncio.Event)
    overrun: bool = False
    _allowed: float = RATE
    _counted: int = 0
    _noticed: dict[tuple[int, str], int] = field(default_factory=dict)

    def tell(self, message: bytes) -> None:
        """Queue a message; too many that wait mark the puppeteer as overrun."""
        if len(self.waiting) >= QUEUE:
            self.overrun = True
        else:
            self.waiting.append(message)
        self.wake.set()

    def may_speak(self, now: int) -> bool:
        """Whether one more message at `now` (µs) is within `RATE`: a bucket that a second's worth fits into."""
        self._allowed = min(self._allowed + (now - self._counted) * RATE * 1e-6, RATE)
        self._counted = now
        if self._allowed < 1.0:
            return False
        self._allowed -= 1.0
        return True

    def notice(self, limb: int, reason: str, now: int) -> None:
        """Say why an input was not taken as it came, once a second for each reason and limb."""
        last = self._noticed.get((limb, reason))
        if last is None or now - last >= NOTICE_EVERY:
            self._noticed[limb, reason] = now
            self.tell(Notice(limb, reason, _DETAILS[reason].format(limb=LIMBS[limb].replace("_", " "))).pack())


class Puppeteers:
    """Those who are at one stage, in the order in which they came."""

    def __init__(self) -> None:
        self._here: dict[str, Puppeteer] = {}

    def __iter__(self) -> Iterator[Puppeteer]:
        return iter(self._here.values())

    def __len__(self) -> int:
        return len(self._here)

    def join(self, name: str) -> Puppeteer:
        """One more, with the first free colour; raises `Full`."""
        if len(self._here) >= MOST:
            raise Full(f"{MOST} puppeteers are here already")
        used = [p.colour for p in self]
        colour = min(range(COLOURS), key=lambda c: (used.count(c), c))
        puppeteer = Puppeteer(secrets.token_hex(5), name, colour)
        self._here[puppeteer.id] = puppeteer
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """One goes."""
        self._here.pop(puppeteer.id, None)

    def tell(self, who: str, message: bytes) -> None:
        """Queue a message for one of them, if still here."""
        if who in self._here:
            self._here[who].tell(message)
