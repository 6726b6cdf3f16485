"""Turns of clients' input: bounded work per iteration of the event loop, fair between addresses."""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict, deque
from collections.abc import Callable
from typing import Protocol

from bunraku.runtime.clock import clock

TURN_US = 1_000
"""Time for frames of clients in each iteration of the event loop, microseconds."""

_log = logging.getLogger(__name__)


class InputHandler(Protocol):
    """Connection that handles received data in turns."""

    source: str
    """Address of the client. Sources with waiting input take turns, whatever their number of connections."""

    def handle_input(self) -> bool:
        """Handle some of the received data. Return whether some of it is left."""

    def pause_reading(self) -> None:
        """Read nothing from the client while received data waits."""

    def resume_reading(self) -> None:
        """Read from the client again, after all received data was handled."""

    def abort(self) -> None:
        """End the connection after a failure."""


class InputScheduler:
    """Scheduler of the input of many connections.

    In each iteration of the event loop, input is handled for about `budget_us` microseconds, at least that of one
    connection, so that timers and other work are late by no more than that, however many clients send at once.
    """

    def __init__(self, budget_us: int, clock: Callable[[], int] = clock) -> None:
        self._budget_us = budget_us
        self._clock = clock
        self._left_us: int | None = None
        self._waiting: OrderedDict[str, deque[InputHandler]] = OrderedDict()

    @property
    def is_busy(self) -> bool:
        """True if received data waits."""
        return bool(self._waiting)

    def schedule(self, handler: InputHandler) -> None:
        """Handle the received data of a connection: now if this iteration has time, else in its turn.

        While data waits, the connection must not be scheduled again.
        """
        if self._waiting or not self._has_time or self._handle(handler):
            handler.pause_reading()
            self._append(handler)

    @property
    def _has_time(self) -> bool:
        return self._left_us is None or self._left_us > 0

    def _append(self, handler: InputHandler) -> None:
        self._waiting.setdefault(handler.source, deque()).append(handler)

    def _handle(self, handler: InputHandler) -> bool:
        """Handle input of a connection. Return whether data is left."""
        if self._left_us is None:
            self._left_us = self._budget_us
            asyncio.get_running_loop().call_soon(self._begin_iteration)
        begun_at = self._clock()
        try:
            return handler.handle_input()
        finally:
            self._left_us -= self._clock() - begun_at

    def _begin_iteration(self) -> None:
        self._left_us = None
        while self._waiting and self._has_time:
            source, handlers = self._waiting.popitem(last=False)
            handler = handlers.popleft()
            if handlers:
                # to the end: the next source has its turn
                self._waiting[source] = handlers
            try:
                if self._handle(handler):
                    self._append(handler)
                else:
                    handler.resume_reading()
            except Exception:
                _log.exception("Handling the input of a client failed; its connection is closed")
                handler.abort()
