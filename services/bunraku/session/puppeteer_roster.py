"""Who pulls at a stage, through whichever replica they came in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from bunraku.session.notice_throttle import NoticeThrottle
from bunraku.wire.messages import Refusal

COLOUR_COUNT = 5
MAX_PUPPETEERS = 32
"""Puppeteers of one session."""
LOST_NOTICE_INTERVAL_US = 1_000_000
"""Microseconds after which one who still takes a limb for theirs is told again."""


class SessionFull(Exception):
    """A session that has as many puppeteers as it may."""


@dataclass(eq=False, slots=True)
class Puppeteer:
    """One who may take limbs, and how they are told something: `tell` takes one whole message, and returns at once.
    `heard` is the clock time when something came from them last, microseconds; `granted` are the limbs that were theirs
    and that they have not let go."""

    id: str
    name: str
    colour: int
    send: Callable[[bytes], None]
    last_heard_us: int
    granted_limbs: set[int] = field(default_factory=set)
    _notice_throttle: NoticeThrottle = field(default_factory=NoticeThrottle)
    _lost_notice_us: dict[int, int] = field(default_factory=dict)

    def send_notice(self, limb: int, reason: str, now: int) -> None:
        """Say why an input was not taken as it came."""
        notice = self._notice_throttle.make_notice(limb, reason, now)
        if notice is not None:
            self.send(notice)

    def send_limb_lost(self, limb: int, now: int) -> None:
        """Say that a limb is not theirs any more, at most once a second: what was said before may not have come."""
        if (
            limb in self.granted_limbs
            and now - self._lost_notice_us.get(limb, -LOST_NOTICE_INTERVAL_US) >= LOST_NOTICE_INTERVAL_US
        ):
            self._lost_notice_us[limb] = now
            self.send(Refusal(limb, "lost").pack())


class PuppeteerRoster:
    """Those who are at one stage, in the order in which they came."""

    def __init__(self) -> None:
        self._by_id: dict[str, Puppeteer] = {}

    def __iter__(self) -> Iterator[Puppeteer]:
        return iter(tuple(self._by_id.values()))

    def __len__(self) -> int:
        return len(self._by_id)

    def get(self, puppeteer_id: str) -> Puppeteer | None:
        """The one of this id, None where they are not here."""
        return self._by_id.get(puppeteer_id)

    def join(self, puppeteer_id: str, name: str, send: Callable[[bytes], None], now: int) -> Puppeteer:
        """One more, with the first free colour; raises `Full`."""
        if len(self._by_id) >= MAX_PUPPETEERS:
            raise SessionFull(f"{MAX_PUPPETEERS} puppeteers are here already")
        used = [p.colour for p in self]
        colour = min(range(COLOUR_COUNT), key=lambda c: (used.count(c), c))
        puppeteer = self._by_id[puppeteer_id] = Puppeteer(puppeteer_id, name, colour, send, now)
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """One goes."""
        self._by_id.pop(puppeteer.id, None)
