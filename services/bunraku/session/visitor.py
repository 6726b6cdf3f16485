"""A puppeteer at the door they came in by: what is still to be said to them, and how much they may say."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque

from bunraku.backing.bucket import Bucket
from bunraku.backing.sockets import Refusal
from bunraku.session.notices import RATE, Notices

QUEUE = 64
"""Messages that may wait for a puppeteer."""


class Visitor:
    """One puppeteer's socket, as its replica sees it."""

    def __init__(self) -> None:
        self.id = secrets.token_hex(5)
        self.waiting: deque[bytes] = deque()
        self.wake = asyncio.Event()
        self.overrun = False
        """Whether more waited than may."""
        self.gone = False
        """Whether the stage knows this puppeteer no more."""
        self.turned_out: Refusal | None = None
        """Why they may not be here any more."""
        self._notices = Notices()
        self._speech = Bucket(RATE, RATE)

    def tell(self, message: bytes) -> None:
        """Queue a message; none, of no bytes, says that the stage knows this puppeteer no more."""
        if not message:
            self.gone = True
        elif len(self.waiting) >= QUEUE:
            self.overrun = True
        else:
            self.waiting.append(message)
        self.wake.set()

    def may_speak(self, now: int) -> bool:
        """Whether one more message at `now` (µs) is within `RATE`: a bucket that a second's worth fits into."""
        return self._speech.take(now * 1e-6)

    def turn_out(self, why: Refusal) -> None:
        """They may not be here any more."""
        self.turned_out = why
        self.wake.set()

    def notice(self, limb: int, reason: str, now: int) -> None:
        """Say why an input was not taken as it came."""
        notice = self._notices.due(limb, reason, now)
        if notice is not None:
            self.tell(notice)
