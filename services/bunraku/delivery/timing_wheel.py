"""Timing wheel: many items, each due once, with one timer for all (Varghese and Lauck, "Hashed and hierarchical timing
wheels", 1987).

A timer for each item would wake the process for each. Time is divided into slots, and all items of a slot are due
together. All times are integer microseconds of any one clock.
"""

from __future__ import annotations

import heapq
from typing import Generic, TypeVar

SLOT_US = 20_000
"""Length of a slot: an item is never due early, and at most this much late."""

T = TypeVar("T")


class TimingWheel(Generic[T]):
    """Items that are each scheduled for one instant."""

    def __init__(self) -> None:
        self._slots: dict[int, dict[T, None]] = {}
        self._slot_heap: list[int] = []
        self._slot_of: dict[T, int] = {}

    def __len__(self) -> int:
        return len(self._slot_of)

    def schedule(self, item: T, due: int) -> None:
        """Schedule `item` for `due`; this replaces its earlier schedule."""
        slot = -(-due // SLOT_US)
        before = self._slot_of.get(item)
        if before == slot:
            return
        if before is not None:
            del self._slots[before][item]
        self._slot_of[item] = slot
        items = self._slots.get(slot)
        if items is None:
            self._slots[slot] = {item: None}
            heapq.heappush(self._slot_heap, slot)
        else:
            items[item] = None

    def cancel(self, item: T) -> None:
        """Remove `item`, if it is scheduled."""
        slot = self._slot_of.pop(item, None)
        if slot is not None:
            del self._slots[slot][item]

    def next_due(self) -> int | None:
        """Return when the next items are due; None if nothing is scheduled."""
        while self._slot_heap and not self._slots[self._slot_heap[0]]:
            del self._slots[heapq.heappop(self._slot_heap)]
        return self._slot_heap[0] * SLOT_US if self._slot_heap else None

    def pop_due(self, clock: int, max_items: int) -> list[T]:
        """Remove and return at most `max_items` items that are due by `clock`, the earliest first."""
        found: list[T] = []
        while len(found) < max_items and (due := self.next_due()) is not None and due <= clock:
            items = self._slots[due // SLOT_US]
            while items and len(found) < max_items:
                item = next(iter(items))
                del items[item], self._slot_of[item]
                found.append(item)
        return found
