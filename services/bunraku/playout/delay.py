"""How much later than the reference clock a viewer shows the stage, so that what is pulled has come when it is due.

Adaptive play-out (Ramjee, Kurose, Towsley and Schulzrinne, Infocom 1994): nearly all of the last messages would have
come in time; on a quick line the delay is none. It is slewed and never steps: up at 5 % of the time that passes, down
over some ten seconds. All arguments and results are microseconds.
"""

from __future__ import annotations

import math
from collections import deque

ON_TIME_QUANTILE = 0.95
"""Of the last messages, this part is to come in time."""
DELAY_MARGIN_US = 10_000
"""Beyond that."""
MAX_DELAY_US = 400_000
"""No stage is shown later."""
LATENESS_SAMPLES = 128
"""Messages that are remembered: four seconds, at thirty a second."""
MIN_LATENESS_SAMPLES = 20
"""Nothing is said by fewer: the first one may be an old one, sent to who joins."""
MAX_GROWTH_RATE = 0.05
"""Microseconds a microsecond."""
SHRINK_TIME_CONSTANT_US = 10_000_000
"""Time constant on the way down."""


class PlayoutDelay:
    """The delay of one viewer."""

    def __init__(self) -> None:
        self._lateness: deque[float] = deque(maxlen=LATENESS_SAMPLES)
        # the delay in use was `_from` at local time `_since`, and goes to `_goal`
        self._start = 0.0
        self._started_at = 0
        self._target = 0.0

    def add_lateness(self, lateness: float, local: int) -> None:
        """At local time `local` a message came `late` after it was first needed, below zero before. With none the delay
        stays as it is."""
        self._lateness.append(lateness)
        if len(self._lateness) < MIN_LATENESS_SAMPLES:
            return
        enough = sorted(self._lateness)[math.ceil(ON_TIME_QUANTILE * len(self._lateness)) - 1] + DELAY_MARGIN_US
        self._start = self.at(local)
        self._started_at = max(local, self._started_at)
        self._target = min(max(enough, 0.0), MAX_DELAY_US)

    def at(self, local: int) -> float:
        """The delay in use at local time `local`: on its way to what is enough."""
        passed, away = max(local - self._started_at, 0), self._target - self._start
        if away >= 0.0:
            return min(self._start + MAX_GROWTH_RATE * passed, self._target)
        # no more than the greatest delay over the time constant: within the slew
        return self._target - away * math.exp(-passed / SHRINK_TIME_CONSTANT_US)
