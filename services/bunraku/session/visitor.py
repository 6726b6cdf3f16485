"""A puppeteer at the door they came in by: what is still to be said to them, and how much they may say."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque

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
        self._notices = Notices()
        self._allowed = float(RATE)
        self._counted = 0

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
        self._allowed = min(self._allowed + (now - self._counted) * RATE * 1e-6, RATE)
        self._counted = now
        if self._allowed < 1.0:
            return False
        self._allowed -= 1.0
        return True

    def notice(self, limb: int, reason: str, now: int) -> None:
        """Say why an input was not taken as it came."""
        notice = self._notices.due(limb, reason, now)
        if notice is not None:
            self.tell(notice)
