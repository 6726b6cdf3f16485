"""Play-out delay of a viewer behind the reference clock, so that overlays arrive before they are due.

Adaptive play-out (Ramjee, Kurose, Towsley and Schulzrinne, Infocom 1994): nearly all of the last messages would have
arrived in time; on a fast link the delay is zero. It slews and never steps: up by 5 % of the elapsed time, down over
some ten seconds. All arguments and results are microseconds.
"""

from __future__ import annotations

import math
from collections import deque

ON_TIME_QUANTILE = 0.95
"""Share of the last messages that must arrive in time."""
DELAY_MARGIN_US = 10_000
"""Added to that quantile, microseconds."""
MAX_DELAY_US = 400_000
"""Upper bound of the delay, microseconds."""
LATENESS_SAMPLES = 128
"""Messages in the quantile: four seconds at 30 per second."""
MIN_LATENESS_SAMPLES = 20
"""Minimum number of messages: the first may be an old one, sent to a viewer that joins."""
MAX_GROWTH_RATE = 0.05
"""Upper bound of the growth of the delay, microseconds per microsecond."""
SHRINK_TIME_CONSTANT_US = 10_000_000
"""Time constant of its decrease, microseconds."""


class PlayoutDelay:
    """Play-out delay of one viewer."""

    def __init__(
        self,
        initial_us: float = 0.0,
        on_time_quantile: float = ON_TIME_QUANTILE,
        margin_us: float = DELAY_MARGIN_US,
    ) -> None:
        """Begin with a delay of `initial_us`.

        Later `on_time_quantile` of the last messages arrive in time, by at least `margin_us`.
        """
        self._quantile = on_time_quantile
        self._margin_us = margin_us
        self._lateness: deque[float] = deque(maxlen=LATENESS_SAMPLES)
        # the delay in use was `_start` at local time `_started_at`, and approaches `_target`
        self._start = initial_us
        self._started_at = 0
        self._target = initial_us

    def add_lateness(self, lateness: float, local: int) -> None:
        """Add a message that arrived at local time `local`, `lateness` after it was needed (negative if before).

        Without messages the delay does not change.
        """
        self._lateness.append(lateness)
        if len(self._lateness) < MIN_LATENESS_SAMPLES:
            return
        required = sorted(self._lateness)[math.ceil(self._quantile * len(self._lateness)) - 1] + self._margin_us
        self._start = self.at(local)
        self._started_at = max(local, self._started_at)
        self._target = min(max(required, 0.0), MAX_DELAY_US)

    def at(self, local: int) -> float:
        """Return the delay in use at local time `local`."""
        elapsed, difference = max(local - self._started_at, 0), self._target - self._start
        if difference >= 0.0:
            return min(self._start + MAX_GROWTH_RATE * elapsed, self._target)
        # the rate of decrease is at most MAX_DELAY_US / SHRINK_TIME_CONSTANT_US
        return self._target - difference * math.exp(-elapsed / SHRINK_TIME_CONSTANT_US)
