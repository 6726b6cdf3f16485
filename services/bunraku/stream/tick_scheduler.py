"""Scheduler of the periodic work of all viewers: one event-loop timer, and bounded batches.

A batch is bounded so that other tasks of the event loop run between two batches.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextvars import copy_context
from typing import Protocol

from bunraku.delivery.timing_wheel import SLOT_US, TimingWheel

MAX_BATCH = 32
"""Items that are ticked in one batch, which takes a millisecond or two."""


class Tickable(Protocol):
    """Object with work to do at a scheduled time."""

    def tick(self) -> None:
        """Do the work that is due, and schedule the next tick."""


class TickScheduler:
    """Scheduler with at most one pending tick for each item."""

    def __init__(self, clock: Callable[[], int]) -> None:
        """`clock` returns the reference time in microseconds."""
        self._clock = clock
        self._wheel: TimingWheel[Tickable] = TimingWheel()
        self._timer: asyncio.Handle | None = None
        self._due = 0
        # a tick must not inherit the request id of the request that happened to set the timer
        self._context = copy_context()

    def schedule(self, item: Tickable, due: int) -> None:
        """Tick `item` at clock time `due`, or up to `SLOT_US` later; this replaces its pending tick."""
        self._wheel.schedule(item, due)
        if self._timer is None or due + SLOT_US < self._due:
            self._set_timer()

    def cancel(self, item: Tickable) -> None:
        """Cancel the pending tick of `item`, if any."""
        self._wheel.cancel(item)

    def _set_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self._wheel.next_due()
        if due is not None:
            self._due = due
            wait = max(due - self._clock(), 0) * 1e-6
            self._timer = asyncio.get_running_loop().call_later(wait, self._run, context=self._context)

    def _run(self) -> None:
        self._timer = None
        try:
            for item in self._wheel.pop_due(self._clock(), MAX_BATCH):
                item.tick()
        finally:
            self._set_timer()
