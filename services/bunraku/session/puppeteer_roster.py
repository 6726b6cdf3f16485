"""Puppeteers of a stage, connected through any replica."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from bunraku.session.notice_throttle import NoticeThrottle
from bunraku.wire.messages import Refusal

COLOUR_COUNT = 5
MAX_PUPPETEERS = 32
"""Most puppeteers of one session."""
MAX_PUPPETEERS_PER_SUBJECT = 16
"""Most puppeteers of one session that use tokens of the same subject; no limit without tokens."""
LOST_NOTICE_INTERVAL_US = 1_000_000
"""Interval between two refusals sent to a puppeteer who still acts on a lost limb."""


class SessionFull(Exception):
    """Session with `MAX_PUPPETEERS` puppeteers, or `MAX_PUPPETEERS_PER_SUBJECT` of one subject."""


@dataclass(eq=False, slots=True)
class Puppeteer:
    """Puppeteer of a stage.

    `send` queues one message and returns at once. `last_heard_us` is the clock time of the last message or heartbeat.
    `subject` is that of the token, None without access control.
    `granted_epochs` has the epoch of the last grant of each limb, unless the puppeteer has released it.
    """

    id: str
    name: str
    colour: int
    send: Callable[[bytes], None]
    last_heard_us: int
    subject: str | None = None
    granted_epochs: dict[int, int] = field(default_factory=dict)
    _notice_throttle: NoticeThrottle = field(default_factory=NoticeThrottle)
    _lost_notice_us: dict[int, int] = field(default_factory=dict)

    def send_notice(self, limb: int, reason: str, now: int) -> None:
        """Send a notice about an input, unless it is throttled."""
        notice = self._notice_throttle.make_notice(limb, reason, now)
        if notice is not None:
            self.send(notice)

    def send_limb_lost(self, limb: int, now: int) -> None:
        """Report the loss of a limb, at most once per second: an earlier report may not have arrived."""
        if (
            limb in self.granted_epochs
            and now - self._lost_notice_us.get(limb, -LOST_NOTICE_INTERVAL_US) >= LOST_NOTICE_INTERVAL_US
        ):
            self._lost_notice_us[limb] = now
            self.send(Refusal(limb, "lost").pack())


class PuppeteerRoster:
    """Puppeteers of one stage, in the order of joining."""

    def __init__(self) -> None:
        self._by_id: dict[str, Puppeteer] = {}

    def __iter__(self) -> Iterator[Puppeteer]:
        return iter(tuple(self._by_id.values()))

    def __len__(self) -> int:
        return len(self._by_id)

    def get(self, puppeteer_id: str) -> Puppeteer | None:
        """Return the puppeteer of this id, or None."""
        return self._by_id.get(puppeteer_id)

    def join(
        self, puppeteer_id: str, name: str, send: Callable[[bytes], None], now: int, subject: str | None = None
    ) -> Puppeteer:
        """Add a puppeteer with the first free colour; raises `SessionFull`."""
        if len(self._by_id) >= MAX_PUPPETEERS:
            raise SessionFull(f"{MAX_PUPPETEERS} puppeteers are here already")
        if subject is not None and sum(p.subject == subject for p in self) >= MAX_PUPPETEERS_PER_SUBJECT:
            raise SessionFull(f"{MAX_PUPPETEERS_PER_SUBJECT} puppeteers with this link are here already")
        used = [p.colour for p in self]
        colour = min(range(COLOUR_COUNT), key=lambda c: (used.count(c), c))
        puppeteer = self._by_id[puppeteer_id] = Puppeteer(puppeteer_id, name, colour, send, now, subject)
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """Remove a puppeteer."""
        self._by_id.pop(puppeteer.id, None)
