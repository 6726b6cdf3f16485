"""Event loop on a virtual clock: time advances only when nothing is ready, and the seed orders what is ready."""

from __future__ import annotations

import asyncio
import heapq
import math
from collections import deque
from collections.abc import Callable
from contextvars import Context
from itertools import count
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
        # an attribute of the base class that its type does not declare
        self._ready: deque[asyncio.Handle] = deque()
        # by time in microseconds, then in order of scheduling; tuples are compared faster than handles
        self._timers: list[tuple[int, int, asyncio.TimerHandle]] = []
        self._timer_numbers = count()
        self.set_exception_handler(self._collect_exception)

    def time(self) -> float:
        return self.now_us * 1e-6

    def call_at(  # type: ignore[override]
        self, when: float, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        timer = asyncio.TimerHandle(when, callback, args, self, context)
        heapq.heappush(self._timers, (math.ceil(when * 1e6 - 1e-3), next(self._timer_numbers), timer))
        return timer

    def cancel_timers(self, belongs: Callable[[Context], bool]) -> None:
        """Drop the scheduled calls whose context `belongs` to a process that has died."""
        for _, _, timer in self._timers:
            if belongs(timer._context):  # type: ignore[attr-defined]
                timer.cancel()

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

    def _run_once(self) -> None:
        """Run what is ready, in random order; if nothing is, first advance the clock to the next timer."""
        timers, ready = self._timers, self._ready
        while timers and timers[0][2].cancelled():
            heapq.heappop(timers)
        self._steps_at_once += 1
        if not ready:
            if not timers:
                raise NothingScheduled("no callback is ready and none is scheduled")
            if timers[0][0] > self.now_us:
                self.now_us, self._steps_at_once = timers[0][0], 0
        while timers and timers[0][0] <= self.now_us:
            ready.append(heapq.heappop(timers)[2])
        if self._steps_at_once == MAX_STEPS_AT_ONCE:
            self.unhandled.append(f"the event loop is busy for ever, with {timers[:1]}")
        if len(ready) > 1:
            handles = list(ready)
            self._random.shuffle(handles)
            ready.clear()
            ready.extend(handles)
        for _ in range(len(ready)):
            handle = ready.popleft()
            if not handle.cancelled():
                handle._run()
        self.after_step()

    def _write_to_self(self) -> None:
        """Do nothing: no other thread wakes this loop."""

    def _collect_exception(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        self.unhandled.append(f"{context.get('message')}: {error!r}")
