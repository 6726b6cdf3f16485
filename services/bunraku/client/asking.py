"""What a viewer says by itself: it asks for the time, and tells how it fares (SPEC.md, Ping, Report)."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from bunraku.wire.messages import Ping, Report

BURST = 8
BURST_EVERY = 0.06
ASK_EVERY = 1.0
"""Seconds from one question for the time to the next, of the first few and then."""
UNANSWERED = 2
"""So many questions may be on their way: on a line that all but stands their answers would be all that it carries."""


class Asking:
    """Over one viewer's line, and any that comes after it: `send` says something where there is a line, `now` is the
    local clock in microseconds, `fares` what there is to tell."""

    def __init__(
        self, send: Callable[[bytes], Awaitable[None]], now: Callable[[], int], fares: Callable[[], Report | None]
    ) -> None:
        self._send = send
        self._now = now
        self._fares = fares
        self._anew = asyncio.Event()
        self._room = asyncio.Event()
        self._answered = 0
        self._asked = 0

    def begin(self) -> None:
        """There is a new line."""
        self._asked = self._answered = 0
        self._anew.set()
        self._room.set()

    def answered(self, sequence: int) -> None:
        """The question of this number was answered, and so were those before it."""
        self._answered = max(self._answered, sequence + 1)
        if self._asked - self._answered < UNANSWERED:
            self._room.set()

    async def run(self) -> None:
        """Ask and tell, for ever."""
        while True:
            self._anew.clear()
            while not self._anew.is_set():
                await self._send(Ping(self._asked, self._now()).pack())
                self._asked += 1
                if self._asked > BURST and (fares := self._fares()) is not None:
                    await self._send(fares.pack())
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(BURST_EVERY if self._asked < BURST else ASK_EVERY):
                        await self._anew.wait()
                if self._asked - self._answered >= UNANSWERED:
                    self._room.clear()
                    await self._room.wait()
