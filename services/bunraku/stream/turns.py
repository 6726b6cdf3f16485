"""When viewers have a turn: one timer for all of them, and only so many at a time, so that whatever else is to be done
gets in between."""

from __future__ import annotations

import asyncio
from contextvars import copy_context
from typing import Protocol

from bunraku.backing.backing import clock
from bunraku.playout.wheel import SPOKE, Wheel

MOST = 32
"""Viewers that have their turn one after the other; a millisecond or two."""


class Takes(Protocol):
    """Who has turns."""

    def advance(self) -> None:
        """Have a turn."""


class Turns:
    """The turns of all viewers of a service."""

    def __init__(self) -> None:
        self._wheel: Wheel[Takes] = Wheel()
        self._timer: asyncio.Handle | None = None
        self._due = 0
        # a turn is nobody's request, whoever came when the timer was set
        self._context = copy_context()

    def put(self, who: Takes, due: int) -> None:
        """`who` has a turn at clock time `due`, or a little after; one turn each, the one asked for last."""
        self._wheel.put(who, due)
        if self._timer is None or due + SPOKE < self._due:
            self._set()

    def remove(self, who: Takes) -> None:
        """`who` has no turn any more."""
        self._wheel.remove(who)

    def _set(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self._wheel.next()
        if due is not None:
            self._due = due
            wait = max(due - clock(), 0) * 1e-6
            self._timer = asyncio.get_running_loop().call_later(wait, self._run, context=self._context)

    def _run(self) -> None:
        self._timer = None
        try:
            for who in self._wheel.turn(clock(), MOST):
                who.advance()
        finally:
            self._set()
