"""Rate of a session's Presence messages, each of which goes to every viewer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from bunraku.runtime.token_bucket import TokenBucket
from bunraku.session.viewer_counts import ViewerCounts

PRESENCES_PER_S, PRESENCE_BURST = 20.0, 40
"""Rate of Presence messages, and their number at once: a puppeteer may cause a change with every message."""
VIEWER_COUNT_INTERVAL_S = 0.5
"""Interval between two publications of the viewer count."""


class PresencePublisher:
    """Publisher of a session's presence, and of its viewer count as the stream replicas report it."""

    def __init__(self, send: Callable[[], None], clock: Callable[[], int]) -> None:
        """`send` sends the present state; `clock` returns microseconds."""
        self._send = send
        self._clock = clock
        self._viewer_counts = ViewerCounts(clock)
        self._rate = TokenBucket(PRESENCES_PER_S, PRESENCE_BURST)
        self._timer: asyncio.TimerHandle | None = None
        self._viewer_count_timer: asyncio.TimerHandle | None = None
        self.last_change_us = clock()
        """Clock time of the last change, or of the last message about it."""

    def close(self) -> None:
        """Send nothing more."""
        # drop the reference to the stage, so that both are freed at once
        self._send = _send_nothing
        for timer in (self._viewer_count_timer, self._timer):
            if timer is not None:
                timer.cancel()

    @property
    def viewer_count(self) -> int:
        """Number of viewers at all stream replicas."""
        return self._viewer_counts.total

    def publish(self) -> None:
        """Send the presence, or together with later changes if there were many just now."""
        self.last_change_us = self._clock()
        if self._rate.take(self.last_change_us * 1e-6):
            self._send()
        elif self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(1 / PRESENCES_PER_S, self._on_timer)

    def report_viewers(self, replica: str, count: int) -> None:
        """Record the number of viewers at a stream replica."""
        before = self.viewer_count
        self._viewer_counts.report(replica, count)
        if self.viewer_count != before:
            self._publish_viewer_count()

    def expire_viewer_counts(self, timeout_us: int, stalled_us: int) -> None:
        """Forget the viewers of silent stream replicas, as `ViewerCounts.expire` does."""
        before = self.viewer_count
        self._viewer_counts.expire(timeout_us, stalled_us)
        if self.viewer_count != before:
            self._publish_viewer_count()

    def _on_timer(self) -> None:
        self._timer = None
        self.publish()

    def _publish_viewer_count(self) -> None:
        """Publish the viewer count now, or after the interval if it was published just now.

        Each stream replica reports its own count.
        """
        if self._viewer_count_timer is None:
            self.publish()
            self._viewer_count_timer = asyncio.get_running_loop().call_later(
                VIEWER_COUNT_INTERVAL_S, self._on_viewer_count_timer, self.viewer_count
            )

    def _on_viewer_count_timer(self, published_count: int) -> None:
        self._viewer_count_timer = None
        if published_count != self.viewer_count:
            self._publish_viewer_count()


def _send_nothing() -> None:
    pass
