"""Whose turn it is: many who each wait for an instant of their own, in one place (a timing wheel: Varghese and Lauck,
"Hashed and hierarchical timing wheels", 1987).

A timer each would wake the process for each. Here time is cut into spokes, and all of a spoke have their turn at once.
All times are integer microseconds on any one clock.
"""

from __future__ import annotations

import heapq
from typing import Generic, TypeVar

SLOT_US = 20_000
"""Length of a spoke: nobody has a turn before the time asked for, nor more than this after it."""

T = TypeVar("T")


class TimingWheel(Generic[T]):
    """Who waits, each for one instant: the one asked for last."""

    def __init__(self) -> None:
        self._slots: dict[int, dict[T, None]] = {}
        self._slot_heap: list[int] = []
        self._slot_of: dict[T, int] = {}

    def __len__(self) -> int:
        return len(self._slot_of)

    def schedule(self, item: T, due: int) -> None:
        """`who` has a turn when `due` has come; what was asked before for them is forgotten."""
        spoke = -(-due // SLOT_US)
        before = self._slot_of.get(item)
        if before == spoke:
            return
        if before is not None:
            del self._slots[before][item]
        self._slot_of[item] = spoke
        waiting = self._slots.get(spoke)
        if waiting is None:
            self._slots[spoke] = {item: None}
            heapq.heappush(self._slot_heap, spoke)
        else:
            waiting[item] = None

    def cancel(self, item: T) -> None:
        """`who` has no turn any more; nothing happens where they had none."""
        spoke = self._slot_of.pop(item, None)
        if spoke is not None:
            del self._slots[spoke][item]

    def next_due(self) -> int | None:
        """When the next turn is, None while nobody waits."""
        while self._slot_heap and not self._slots[self._slot_heap[0]]:
            del self._slots[heapq.heappop(self._slot_heap)]
        return self._slot_heap[0] * SLOT_US if self._slot_heap else None

    def pop_due(self, clock: int, max_items: int) -> list[T]:
        """Those whose time has come by `clock`, the first first, but no more than `most`; they wait no more."""
        found: list[T] = []
        while len(found) < max_items and (due := self.next_due()) is not None and due <= clock:
            waiting = self._slots[due // SLOT_US]
            while waiting and len(found) < max_items:
                who = next(iter(waiting))
                del waiting[who], self._slot_of[who]
                found.append(who)
        return found
