"""Event loop on a virtual clock: time advances only when nothing is ready, and the seed orders what is ready."""

from __future__ import annotations

import asyncio
import heapq
import math
from collections import deque
from collections.abc import Callable
from contextvars import Context
from random import Random
from typing import Any

MAX_THREAD_US = 20_000
"""Longest duration of a call in a thread, virtual microseconds."""
MAX_STEPS_AT_ONCE = 5_000
"""Iterations without time passing after which the loop counts as busy for ever."""


class NothingScheduled(Exception):
    """An event loop that waits for ever."""


class VirtualEventLoop(asyncio.BaseEventLoop):
    """Event loop without threads, sockets and waiting.

    Calls in a thread run in the loop, after a random virtual duration. Exceptions that nothing handles are collected in
    `unhandled`.
    """

    def __init__(self, random: Random) -> None:
        self.now_us = 0
        """Virtual time since the start."""
        self.unhandled: list[str] = []
        self._steps_at_once = 0
        self.after_step: Callable[[], None] = lambda: None
        """Function that is called after each iteration."""
        self._random = random
        super().__init__()
        # attributes of the base class that its type does not declare
        self._ready: deque[asyncio.Handle] = deque()
        self._scheduled: list[asyncio.TimerHandle] = []
        self._selector = self
        self._clock_resolution = 0.5e-6
        self.set_exception_handler(self._collect_exception)

    def time(self) -> float:
        return self.now_us * 1e-6

    def select(self, timeout: float | None) -> list[Any]:
        """Advance the clock by `timeout` seconds instead of waiting; raise `NothingScheduled` without one."""
        if timeout is None:
            raise NothingScheduled("no callback is ready and none is scheduled")
        elapsed_us = math.ceil(timeout * 1e6 - 1e-3)
        self.now_us += elapsed_us
        self._steps_at_once = 0 if elapsed_us else self._steps_at_once + 1
        if self._steps_at_once == MAX_STEPS_AT_ONCE:
            self.unhandled.append(f"the event loop is busy for ever, with {self._scheduled[:1]}")
        return []

    def cancel_timers(self, belongs: Callable[[Context], bool]) -> None:
        """Drop the scheduled calls whose context `belongs` to a process that has died."""
        kept = []
        for timer in self._scheduled:
            if belongs(timer._context):  # type: ignore[attr-defined]
                timer._cancelled, timer._scheduled = True, False  # type: ignore[attr-defined]
            else:
                kept.append(timer)
        heapq.heapify(kept)
        self._scheduled = kept

    def run_in_executor(self, _: Any, function: Callable[..., Any], *args: Any) -> asyncio.Future[Any]:  # type: ignore[override]
        future: asyncio.Future[Any] = self.create_future()

        def run() -> None:
            # a thread that has started runs to its end, even if nobody waits for it any more
            try:
                result = function(*args)
            except Exception as error:
                if not future.done():
                    future.set_exception(error)
            else:
                if not future.done():
                    future.set_result(result)

        self.call_later(self._random.randrange(1, MAX_THREAD_US) * 1e-6, run)
        return future

    def _process_events(self, _events: list[Any]) -> None:
        if len(self._ready) > 1:
            ready = list(self._ready)
            self._random.shuffle(ready)
            self._ready = deque(ready)

    def _run_once(self) -> None:
        super()._run_once()  # type: ignore[misc]
        self.after_step()

    def _write_to_self(self) -> None:
        """Do nothing: no other thread wakes this loop."""

    def _collect_exception(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        self.unhandled.append(f"{context.get('message')}: {error!r}")
