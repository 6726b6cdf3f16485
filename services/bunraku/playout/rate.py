"""Which rate a viewer gets, and why: by its line and by its machine, as the paper asks (paper 2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bunraku.playout.pacing import AHEAD
from bunraku.playout.window import HEADS
from bunraku.wire.messages import Report

LOW = 800_000
"""Less than this ready ahead, microseconds, says that the line does not carry the rate."""
HIGH = AHEAD * 6 // 10
"""As much as this ready ahead, for `PATIENCE`, says that the line carries more."""
PATIENCE = 3_000_000
SLOW_FRAME = 50_000
SLOW_DECODE = 20_000
SHARE = 0.8
"""Of a narrow line that blocks may take."""
SHARE_BESIDE = 0.1
"""The same while limbs are pulled: hands that are late are seen sooner than a coarser dance."""
STEADY = 3_000_000
"""What a line carries is its mean over about this time, microseconds,"""
SLOWED = 0.7
"""but beside hands one that carries less than this share of it counts as slower at once: they would wait."""


class RateChoice:
    """The rate of one viewer, from the reports it sends each second and what its line carries; times are clock times in
    microseconds.

    `rate` is a step of how motion and sound share the line (`sharing`), and `reason` one of `best` (the highest there
    is), `line` (it carries no more), `hands` (pulled limbs go before a finer dance), `machine` (frames or blocks take
    the viewer too long), `buffer` (too little was ready ahead), `start` (more is tried once this goes well), `hidden`
    (a tab that nobody sees), `pinned` (the viewer asked for it).
    """

    def __init__(
        self,
        rates: int,
        pinned: int | None = None,
        first: int | None = None,
        safe: int = 0,
        costs: Sequence[float] = (),
    ) -> None:
        """`first` is the rate to begin with, if not the highest; `safe` the one of who does not look or cannot keep up
        with more: a line that does not carry it gets less; `costs` are the rates' in kbit/s, lowest first: without them
        what the line carries says nothing."""
        self._highest = rates - 1
        self._safe = safe
        self._pinned = pinned is not None
        begun = pinned if pinned is not None else first if first is not None else self._highest
        self._wanted = min(max(begun, 0), self._highest)
        self._costs = costs
        self._since: int | None = None
        self._hidden = False
        self._lowered = "start"
        self._carried: float | None = None
        self._carried_at = 0
        self._by_line = self._highest
        self._beside = False

    @property
    def rate(self) -> int:
        """The rate now."""
        if self._pinned:
            return self._wanted
        rate = min(self._wanted, self._by_line)
        return min(self._safe, rate) if self._hidden else rate

    @property
    def reason(self) -> str:
        """Why, in one word of `Choice`."""
        if self._pinned:
            return "pinned"
        if self._hidden:
            return "hidden"
        if self._by_line < self._wanted:
            return "hands" if self._beside else "line"
        return self._lowered if self._wanted < self._highest else "best"

    @property
    def carried(self) -> int | None:
        """What the line carries with all heads, bit/s to the nearest 100, None where it is not narrow."""
        return None if self._carried is None else round(self._carried * 8 / 100) * 100

    def line(self, carried: float | None, clock: int, beside: bool) -> None:
        """A narrow line carries so many bytes a second, heads included; None where it is not narrow. `beside` says that
        pulled limbs share it."""
        if carried is None or not self._costs:
            self._carried, self._by_line = None, self._highest
            return
        if self._carried is None or (beside and carried < SLOWED * self._carried):
            self._carried = carried
        else:
            self._carried += (carried - self._carried) * -math.expm1(-max(clock - self._carried_at, 0) / STEADY)
        self._carried_at, self._beside = clock, beside
        # a block that is on its way when the line becomes slow keeps all else waiting: no more than it carries now
        share = min(self._carried, carried) * (SHARE_BESIDE if beside else SHARE)
        best = max((n for n, kbps in enumerate(self._costs) if kbps * 125 + HEADS <= share), default=0)
        # a rate that was left is taken again only when there is some room to spare
        if best <= self._by_line or self._costs[best] * 125 + HEADS <= share * 0.9:
            self._by_line = best

    def report(self, report: Report, clock: int) -> int:
        """Take in a viewer's report; the rate from now on."""
        if self._pinned:
            return self.rate
        if report.hidden != self._hidden:
            # its own rate is kept for when it is seen again
            self._hidden = report.hidden
            self._since = clock
        if self._hidden:
            return self.rate
        if self._since is None:
            self._since = clock
        settled = clock - self._since
        struggling = report.frame > SLOW_FRAME or report.decode > SLOW_DECODE
        if report.buffer < LOW and settled >= 1_000_000:
            self._lowered = "buffer"
            self._move(-1, clock)
        elif struggling and settled >= 1_000_000:
            if self.rate > self._safe:
                self._lowered = "machine"
                self._move(-1, clock)
        elif report.buffer >= HIGH and not struggling and settled >= PATIENCE:
            self._move(1, clock)
        return self.rate

    def _move(self, by: int, clock: int) -> None:
        self._wanted = min(max(self._wanted + by, 0), self._highest)
        self._since = clock
