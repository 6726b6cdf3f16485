"""How much later than the reference clock a viewer shows the stage, so that what is pulled has come when it is due.

Adaptive play-out (Ramjee, Kurose, Towsley and Schulzrinne, Infocom 1994): nearly all of the last messages would have
come in time; on a quick line the delay is none. It is slewed and never steps: up at 5 % of the time that passes, down
over some ten seconds. All arguments and results are microseconds.
"""

from __future__ import annotations

import math
from collections import deque

SHARE = 0.95
"""Of the last messages, this part is to come in time."""
MARGIN = 10_000
"""Beyond that."""
GREATEST = 400_000
"""No stage is shown later."""
KEPT = 128
"""Messages that are remembered: four seconds, at thirty a second."""
LEAST = 20
"""Nothing is said by fewer: the first one may be an old one, sent to who joins."""
SLEW = 0.05
"""Microseconds a microsecond."""
SHRINKING = 10_000_000
"""Time constant on the way down."""


class PlayoutDelay:
    """The delay of one viewer."""

    def __init__(self) -> None:
        self._late: deque[float] = deque(maxlen=KEPT)
        # the delay in use was `_from` at local time `_since`, and goes to `_goal`
        self._from = 0.0
        self._since = 0
        self._goal = 0.0

    def heard(self, late: float, local: int) -> None:
        """At local time `local` a message came `late` after it was first needed, below zero before. With none the delay
        stays as it is."""
        self._late.append(late)
        if len(self._late) < LEAST:
            return
        enough = sorted(self._late)[math.ceil(SHARE * len(self._late)) - 1] + MARGIN
        self._from = self.at(local)
        self._since = max(local, self._since)
        self._goal = min(max(enough, 0.0), GREATEST)

    def at(self, local: int) -> float:
        """The delay in use at local time `local`: on its way to what is enough."""
        passed, away = max(local - self._since, 0), self._goal - self._from
        if away >= 0.0:
            return min(self._from + SLEW * passed, self._goal)
        # no more than the greatest delay over the time constant: within the slew
        return self._goal - away * math.exp(-passed / SHRINKING)
