"""When a line that is otherwise never still falls still, so that the time can be told over it: an answer that waits in
the line's queue tells it wrong."""

from __future__ import annotations

from bunraku.stream.flow import Flow

LONGER = 15_000
"""A line is given so much longer to fall still, microseconds,"""
MOST = 500_000
"""but no longer than this in all,"""
EVERY = 2_000_000
"""and so often at most,"""
FIRST = 4
"""the first ones four times as often."""


class Hush:
    """Of one viewer's line."""

    __slots__ = ("_again", "_count", "until")

    def __init__(self) -> None:
        self.until = 0
        """Clock time until which nothing is written, microseconds."""
        self._again = self._count = 0

    def begin(self, now: int, flow: Flow) -> bool:
        """Begin one at clock time `now`, where the line is full and none was of late; whether it does."""
        if now < self.until or now < self._again or flow.steady or flow.window.rate is None:
            return False
        self._again = now + (EVERY if self._count >= FIRST else EVERY // 4)
        self._count += 1
        self.until = now + min(flow.window.busy(now) + LONGER, MOST)
        return True
