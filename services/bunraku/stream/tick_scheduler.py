"""When viewers have a turn: one timer for all of them, and only so many at a time, so that whatever else is to be done
gets in between."""

from __future__ import annotations

import asyncio
from contextvars import copy_context
from typing import Protocol

from bunraku.delivery.timing_wheel import SLOT_US, TimingWheel
from bunraku.runtime.clock import clock

MAX_BATCH = 32
"""Viewers that have their turn one after the other; a millisecond or two."""


class Tickable(Protocol):
    """Who has turns."""

    def tick(self) -> None:
        """Have a turn."""


class TickScheduler:
    """The turns of all viewers of a service."""

    def __init__(self) -> None:
        self._wheel: TimingWheel[Tickable] = TimingWheel()
        self._timer: asyncio.Handle | None = None
        self._due = 0
        # a turn is nobody's request, whoever came when the timer was set
        self._context = copy_context()

    def schedule(self, item: Tickable, due: int) -> None:
        """`who` has a turn at clock time `due`, or a little after; one turn each, the one asked for last."""
        self._wheel.schedule(item, due)
        if self._timer is None or due + SLOT_US < self._due:
            self._set_timer()

    def cancel(self, item: Tickable) -> None:
        """`who` has no turn any more."""
        self._wheel.cancel(item)

    def _set_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self._wheel.next_due()
        if due is not None:
            self._due = due
            wait = max(due - clock(), 0) * 1e-6
            self._timer = asyncio.get_running_loop().call_later(wait, self._run, context=self._context)

    def _run(self) -> None:
        self._timer = None
        try:
            for who in self._wheel.pop_due(clock(), MAX_BATCH):
                who.tick()
        finally:
            self._set_timer()
