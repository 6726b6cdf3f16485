"""What a viewer says by itself: it asks for the time, and tells how it fares (SPEC.md, Ping, Report)."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from bunraku.wire.messages import Ping, Report

INITIAL_PINGS = 8
INITIAL_PING_INTERVAL_S = 0.06
PING_INTERVAL_S = 1.0
"""Seconds from one question for the time to the next, of the first few and then."""
MAX_UNANSWERED_PINGS = 2
"""So many questions may be on their way: on a line that all but stands their answers would be all that it carries."""


class ViewerReporter:
    """Over one viewer's line, and any that comes after it: `send` says something where there is a line, `now` is the
    local clock in microseconds, `fares` what there is to tell."""

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
        """There is a new line."""
        self._ping_count = self._answered_count = 0
        self._restarted.set()
        self._may_ping.set()

    def on_pong(self, sequence: int) -> None:
        """The question of this number was answered, and so were those before it."""
        self._answered_count = max(self._answered_count, sequence + 1)
        if self._ping_count - self._answered_count < MAX_UNANSWERED_PINGS:
            self._may_ping.set()

    async def run(self) -> None:
        """Ask and tell, for ever."""
        while True:
            self._restarted.clear()
            while not self._restarted.is_set():
                await self._send(Ping(self._ping_count, self._clock()).pack())
                self._ping_count += 1
                if self._ping_count > INITIAL_PINGS and (fares := self._make_report()) is not None:
                    await self._send(fares.pack())
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(
                        INITIAL_PING_INTERVAL_S if self._ping_count < INITIAL_PINGS else PING_INTERVAL_S
                    ):
                        await self._restarted.wait()
                if self._ping_count - self._answered_count >= MAX_UNANSWERED_PINGS:
                    self._may_ping.clear()
                    await self._may_ping.wait()
