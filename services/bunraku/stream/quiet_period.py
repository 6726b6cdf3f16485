"""When a line that is otherwise never still falls still, so that the time can be told over it: an answer that waits in
the line's queue tells it wrong."""

from __future__ import annotations

from bunraku.stream.flow_control import FlowControl

QUIET_MARGIN_US = 15_000
"""A line is given so much longer to fall still, microseconds,"""
MAX_QUIET_PERIOD_US = 500_000
"""but no longer than this in all,"""
QUIET_INTERVAL_US = 2_000_000
"""and so often at most,"""
INITIAL_QUIET_PERIODS = 4
"""the first ones four times as often."""


class QuietPeriod:
    """Of one viewer's line."""

    __slots__ = ("_count", "_next_at", "ends_at")

    def __init__(self) -> None:
        self.ends_at = 0
        """Clock time until which nothing is written, microseconds."""
        self._next_at = self._count = 0

    def start(self, now: int, flow: FlowControl) -> bool:
        """Begin one at clock time `now`, where the line is full and none was of late; whether it does."""
        if now < self.ends_at or now < self._next_at or flow.is_unconstrained or flow.window.throughput is None:
            return False
        self._next_at = now + (QUIET_INTERVAL_US if self._count >= INITIAL_QUIET_PERIODS else QUIET_INTERVAL_US // 4)
        self._count += 1
        self.ends_at = now + min(flow.window.time_to_drain(now) + QUIET_MARGIN_US, MAX_QUIET_PERIOD_US)
        return True
