"""A puppeteer at the door they came in by: what is still to be said to them, and how much they may say."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque

from bunraku.http.token_bucket import TokenBucket
from bunraku.session.notice_throttle import MAX_MESSAGES_PER_S, NoticeThrottle
from bunraku.websocket.subprotocol import CloseConnection

MAX_QUEUED_MESSAGES = 64
"""Messages that may wait for a puppeteer."""


class PuppeteerConnection:
    """One puppeteer's socket, as its replica sees it."""

    def __init__(self) -> None:
        self.id = secrets.token_hex(5)
        self.queued: deque[bytes] = deque()
        self.has_messages = asyncio.Event()
        self.is_overrun = False
        """Whether more waited than may."""
        self.is_unknown = False
        """Whether the stage knows this puppeteer no more."""
        self.close_reason: CloseConnection | None = None
        """Why they may not be here any more."""
        self._notice_throttle = NoticeThrottle()
        self._message_rate = TokenBucket(MAX_MESSAGES_PER_S, MAX_MESSAGES_PER_S)

    def send(self, message: bytes) -> None:
        """Queue a message; none, of no bytes, says that the stage knows this puppeteer no more."""
        if not message:
            self.is_unknown = True
        elif len(self.queued) >= MAX_QUEUED_MESSAGES:
            self.is_overrun = True
        else:
            self.queued.append(message)
        self.has_messages.set()

    def may_send(self, now: int) -> bool:
        """Whether one more message at `now` (µs) is within `RATE`: a bucket that a second's worth fits into."""
        return self._message_rate.take(now * 1e-6)

    def close(self, reason: CloseConnection) -> None:
        """They may not be here any more."""
        self.close_reason = reason
        self.has_messages.set()

    def send_notice(self, limb: int, reason: str, now: int) -> None:
        """Say why an input was not taken as it came."""
        notice = self._notice_throttle.make_notice(limb, reason, now)
        if notice is not None:
            self.send(notice)
