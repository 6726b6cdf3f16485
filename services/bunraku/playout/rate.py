"""Which rate a viewer gets: by its line and by its machine, as the paper asks (paper 2)."""

from __future__ import annotations

from bunraku.playout.pacing import AHEAD
from bunraku.wire.messages import Report

LOW = 800_000
"""Less than this ready ahead, microseconds, says that the line does not carry the rate."""
HIGH = AHEAD * 6 // 10
"""As much as this ready ahead, for `PATIENCE`, says that the line carries more."""
PATIENCE = 3_000_000
SLOW_FRAME = 50_000
SLOW_DECODE = 20_000


class RateChoice:
    """The rate of one viewer, from the reports it sends each second; times are clock times in microseconds."""

    def __init__(self, rates: int, pinned: int | None = None, first: int | None = None, safe: int = 0) -> None:
        """`first` is the rate to begin with, if not the highest; `safe` the one of who does not look or cannot keep up
        with more: a line that does not carry it gets less."""
        self._highest = rates - 1
        self._safe = safe
        self._pinned = pinned is not None
        begun = pinned if pinned is not None else first if first is not None else self._highest
        self.rate = min(max(begun, 0), self._highest)
        self._since: int | None = None
        self._hidden = False
        self._shown = self.rate

    def report(self, report: Report, clock: int) -> int:
        """Take in a viewer's report; the rate from now on."""
        if self._pinned:
            return self.rate
        if report.hidden != self._hidden:
            # a tab that nobody sees gets the safety rate, and its own again when it is seen
            self._hidden = report.hidden
            if report.hidden:
                self._shown, self.rate = self.rate, min(self._safe, self.rate)
            else:
                self.rate = self._shown
            self._since = clock
        if self._hidden:
            return self.rate
        if self._since is None:
            self._since = clock
        settled = clock - self._since
        struggling = report.frame > SLOW_FRAME or report.decode > SLOW_DECODE
        if report.buffer < LOW and settled >= 1_000_000:
            self._move(-1, clock)
        elif struggling and settled >= 1_000_000:
            if self.rate > self._safe:
                self._move(-1, clock)
        elif report.buffer >= HIGH and not struggling and settled >= PATIENCE:
            self._move(1, clock)
        return self.rate

    def _move(self, by: int, clock: int) -> None:
        self.rate = min(max(self.rate + by, 0), self._highest)
        self._since = clock
