"""Who pulls at a stage, through whichever replica they came in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from bunraku.session.notices import Notices
from bunraku.wire.messages import Refusal

COLOURS = 5
MOST = 32
"""Puppeteers of one session."""
REMINDED = 1_000_000
"""Microseconds after which one who still takes a limb for theirs is told again."""


class Full(Exception):
    """A session that has as many puppeteers as it may."""


@dataclass(eq=False, slots=True)
class Puppeteer:
    """One who may take limbs, and how they are told something: `tell` takes one whole message, and returns at once.
    `heard` is the clock time when something came from them last, microseconds; `granted` are the limbs that were theirs
    and that they have not let go."""

    id: str
    name: str
    colour: int
    tell: Callable[[bytes], None]
    heard: int
    granted: set[int] = field(default_factory=set)
    _notices: Notices = field(default_factory=Notices)
    _lost: dict[int, int] = field(default_factory=dict)

    def notice(self, limb: int, reason: str, now: int) -> None:
        """Say why an input was not taken as it came."""
        notice = self._notices.due(limb, reason, now)
        if notice is not None:
            self.tell(notice)

    def lost(self, limb: int, now: int) -> None:
        """Say that a limb is not theirs any more, at most once a second: what was said before may not have come."""
        if limb in self.granted and now - self._lost.get(limb, -REMINDED) >= REMINDED:
            self._lost[limb] = now
            self.tell(Refusal(limb, "lost").pack())


class Puppeteers:
    """Those who are at one stage, in the order in which they came."""

    def __init__(self) -> None:
        self._here: dict[str, Puppeteer] = {}

    def __iter__(self) -> Iterator[Puppeteer]:
        return iter(tuple(self._here.values()))

    def __len__(self) -> int:
        return len(self._here)

    def get(self, who: str) -> Puppeteer | None:
        """The one of this id, None where they are not here."""
        return self._here.get(who)

    def join(self, who: str, name: str, tell: Callable[[bytes], None], now: int) -> Puppeteer:
        """One more, with the first free colour; raises `Full`."""
        if len(self._here) >= MOST:
            raise Full(f"{MOST} puppeteers are here already")
        used = [p.colour for p in self]
        colour = min(range(COLOURS), key=lambda c: (used.count(c), c))
        puppeteer = self._here[who] = Puppeteer(who, name, colour, tell, now)
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """One goes."""
        self._here.pop(puppeteer.id, None)
