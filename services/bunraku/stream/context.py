"""Objects that all viewers of one stream replica share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bunraku.stream.counters import StreamCounters
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.websocket.multicast import LazySender


@dataclass(frozen=True, slots=True)
class StreamContext:
    """Clock, tick scheduler, counters and multicast sender of one replica."""

    clock: Callable[[], int]
    """Reference clock, microseconds since 1970."""
    scheduler: TickScheduler
    counters: StreamCounters
    sender: LazySender

    @classmethod
    def create(cls, clock: Callable[[], int]) -> StreamContext:
        """Return a context with a new scheduler, counters and sender."""
        return cls(clock, TickScheduler(clock), StreamCounters(), LazySender())
