"""Periodic messages of a viewer: clock pings and reports (proto/messages.md, 3.6 and 3.8)."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from bunraku.wire.messages import Ping, Report

INITIAL_PINGS = 8
"""Pings of a new connection that are sent at the shorter interval."""
INITIAL_PING_INTERVAL_S = 0.06
PING_INTERVAL_S = 1.0
"""Interval between further pings."""
MAX_UNANSWERED_PINGS = 2
"""Pings in flight: on a stalled link their answers would use all of its bandwidth."""


class ViewerReporter:
    """Sender of pings and reports over the current connection.

    `send` sends a message if connected, `clock` is the local clock in microseconds, `make_report` returns the current
    report.
    """

    def __init__(
        self,
        send: Callable[[bytes], Awaitable[None]],
        clock: Callable[[], int],
        make_report: Callable[[], Report | None],
    ) -> None:
        self._send = send
        self._clock = clock
        self._make_report = make_report
        self._restarted = asyncio.Event()
        self._may_ping = asyncio.Event()
        self._answered_count = 0
        self._ping_count = 0

    def restart(self) -> None:
        """Start anew on a new connection."""
        self._ping_count = self._answered_count = 0
        self._restarted.set()
        self._may_ping.set()

    def on_pong(self, sequence: int) -> None:
        """Record the answer to a ping and to all before it."""
        self._answered_count = max(self._answered_count, sequence + 1)
        if self._ping_count - self._answered_count < MAX_UNANSWERED_PINGS:
            self._may_ping.set()

    async def run(self) -> None:
        """Send pings and reports until cancelled."""
        while True:
            self._restarted.clear()
            while not self._restarted.is_set():
                await self._send(Ping(self._ping_count, self._clock()).pack())
                self._ping_count += 1
                if self._ping_count > INITIAL_PINGS and (report := self._make_report()) is not None:
                    await self._send(report.pack())
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(
                        INITIAL_PING_INTERVAL_S if self._ping_count < INITIAL_PINGS else PING_INTERVAL_S
                    ):
                        await self._restarted.wait()
                if self._ping_count - self._answered_count >= MAX_UNANSWERED_PINGS:
                    self._may_ping.clear()
                    await self._may_ping.wait()
