"""Objects that all viewers of one stream replica share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bunraku.stream.counters import StreamCounters
from bunraku.stream.tick_scheduler import TickScheduler


@dataclass(frozen=True, slots=True)
class StreamContext:
    """Clock, tick scheduler and counters of one replica."""

    clock: Callable[[], int]
    """Reference clock, microseconds since 1970."""
    scheduler: TickScheduler
    counters: StreamCounters

    @classmethod
    def create(cls, clock: Callable[[], int]) -> StreamContext:
        """Return a context with a new scheduler and new counters."""
        return cls(clock, TickScheduler(clock), StreamCounters())
