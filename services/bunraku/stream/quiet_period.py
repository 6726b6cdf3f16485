"""Quiet periods for the clock samples of one viewer. All times are clock times in microseconds."""

from __future__ import annotations

from bunraku.stream.flow_control import FlowControl

QUIET_MARGIN_US = 15_000
"""Added to the estimated time in which a link drains, microseconds."""
MAX_QUIET_PERIOD_US = 500_000
"""Upper bound of one quiet period, microseconds."""
QUIET_INTERVAL_US = 2_000_000
"""Minimum time between the starts of two quiet periods, microseconds."""
INITIAL_QUIET_PERIODS = 4
"""The first quiet periods are allowed at a quarter of the interval."""


class QuietPeriod:
    """Pause in sending, so that a clock sample is not delayed by queued data.

    An answer that waits in the link's queue makes the clock estimate wrong by up to half its delay.
    """

    __slots__ = ("_count", "_next_at", "ends_at")

    def __init__(self) -> None:
        self.ends_at = 0
        """Time until which nothing is written."""
        self._next_at = self._count = 0

    def start(self, now: int, flow: FlowControl) -> bool:
        """Start a pause if the link is paced and measured, and the last pause was long enough ago.

        Return True if a pause starts; it lasts until the link has drained.
        """
        if (
            now < self.ends_at
            or now < self._next_at
            or flow.state.skips_overlay_check
            or flow.window.throughput is None
        ):
            return False
        self._next_at = now + (QUIET_INTERVAL_US if self._count >= INITIAL_QUIET_PERIODS else QUIET_INTERVAL_US // 4)
        self._count += 1
        self.ends_at = now + min(flow.window.time_to_drain(now) + QUIET_MARGIN_US, MAX_QUIET_PERIOD_US)
        return True
