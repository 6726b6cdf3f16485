"""Numbers of viewers of a session that the stream replicas report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(slots=True)
class _Report:
    count: int
    last_heard_us: int


class ViewerCounts:
    """Viewers by stream replica. `clock` returns microseconds."""

    def __init__(self, clock: Callable[[], int]) -> None:
        self._clock = clock
        self._reports: dict[str, _Report] = {}

    @property
    def total(self) -> int:
        """Number of viewers at all replicas that have reported lately."""
        return sum(report.count for report in self._reports.values())

    def report(self, replica: str, count: int) -> None:
        """Record the number of viewers at a replica."""
        self._reports.pop(replica, None)
        if count:
            self._reports[replica] = _Report(count, self._clock())

    def expire(self, timeout_us: int, stalled_us: int = 0) -> None:
        """Forget the replicas that have not reported for `timeout_us`.

        During the last `stalled_us` the event loop was blocked, and no report could be received.
        """
        oldest_us = self._clock() - timeout_us
        for replica, report in tuple(self._reports.items()):
            report.last_heard_us += stalled_us
            if report.last_heard_us < oldest_us:
                del self._reports[replica]
