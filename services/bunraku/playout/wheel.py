"""Whose turn it is: many who each wait for an instant of their own, in one place (a timing wheel: Varghese and Lauck,
"Hashed and hierarchical timing wheels", 1987).

A timer each would wake the process for each. Here time is cut into spokes, and all of a spoke have their turn at once.
All times are integer microseconds on any one clock.
"""

from __future__ import annotations

import heapq
from typing import Generic, TypeVar

SPOKE = 20_000
"""Length of a spoke: nobody has a turn before the time asked for, nor more than this after it."""

T = TypeVar("T")


class Wheel(Generic[T]):
    """Who waits, each for one instant: the one asked for last."""

    def __init__(self) -> None:
        self._spokes: dict[int, dict[T, None]] = {}
        self._order: list[int] = []
        self._waiting: dict[T, int] = {}

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, who: T, due: int) -> None:
        """`who` has a turn when `due` has come; what was asked before for them is forgotten."""
        spoke = -(-due // SPOKE)
        before = self._waiting.get(who)
        if before == spoke:
            return
        if before is not None:
            del self._spokes[before][who]
        self._waiting[who] = spoke
        waiting = self._spokes.get(spoke)
        if waiting is None:
            self._spokes[spoke] = {who: None}
            heapq.heappush(self._order, spoke)
        else:
            waiting[who] = None

    def remove(self, who: T) -> None:
        """`who` has no turn any more; nothing happens where they had none."""
        spoke = self._waiting.pop(who, None)
        if spoke is not None:
            del self._spokes[spoke][who]

    def next(self) -> int | None:
        """When the next turn is, None while nobody waits."""
        while self._order and not self._spokes[self._order[0]]:
            del self._spokes[heapq.heappop(self._order)]
        return self._order[0] * SPOKE if self._order else None

    def turn(self, clock: int, most: int) -> list[T]:
        """Those whose time has come by `clock`, the first first, but no more than `most`; they wait no more."""
        found: list[T] = []
        while len(found) < most and (due := self.next()) is not None and due <= clock:
            waiting = self._spokes[due // SPOKE]
            while waiting and len(found) < most:
                who = next(iter(waiting))
                del waiting[who], self._waiting[who]
                found.append(who)
        return found
