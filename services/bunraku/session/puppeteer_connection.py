"""Connection of a puppeteer on the replica that accepted it: send queue and rate limit."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque

from bunraku.http.token_bucket import TokenBucket
from bunraku.session.notice_throttle import MAX_MESSAGES_PER_S, NoticeThrottle
from bunraku.websocket.subprotocol import CloseConnection

MAX_QUEUED_MESSAGES = 64
"""Size of the send queue."""


class PuppeteerConnection:
    """Send queue and rate limit of one puppeteer's WebSocket."""

    def __init__(self) -> None:
        self.id = secrets.token_hex(5)
        self.queued: deque[bytes] = deque()
        self.has_messages = asyncio.Event()
        self.is_overrun = False
        """True if the send queue was full."""
        self.is_unknown = False
        """True if the stage no longer knows this puppeteer."""
        self.close_reason: CloseConnection | None = None
        """Reason to close the connection."""
        self._notice_throttle = NoticeThrottle()
        self._message_rate = TokenBucket(MAX_MESSAGES_PER_S, MAX_MESSAGES_PER_S)

    def send(self, message: bytes) -> None:
        """Queue a message; an empty one means that the stage no longer knows this puppeteer."""
        if not message:
            self.is_unknown = True
        elif len(self.queued) >= MAX_QUEUED_MESSAGES:
            self.is_overrun = True
        else:
            self.queued.append(message)
        self.has_messages.set()

    def may_send(self, now: int) -> bool:
        """Return whether a message at `now` (µs) is within the rate limit, a token bucket of one second."""
        return self._message_rate.take(now * 1e-6)

    def close(self, reason: CloseConnection) -> None:
        """Close the connection with a reason."""
        self.close_reason = reason
        self.has_messages.set()

    def send_notice(self, limb: int, reason: str, now: int) -> None:
        """Send a notice about an input, unless it is throttled."""
        notice = self._notice_throttle.make_notice(limb, reason, now)
        if notice is not None:
            self.send(notice)
