"""Which rate a viewer gets, and why: by its line and by its machine, as the paper asks (paper 2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bunraku.delivery.block_scheduler import SEND_AHEAD_US
from bunraku.delivery.congestion import HEADER_BYTES
from bunraku.wire.messages import Report

LOW_BUFFER_US = 800_000
"""Less than this ready ahead, microseconds, says that the line does not carry the rate."""
HIGH_BUFFER_US = SEND_AHEAD_US * 6 // 10
"""As much as this ready ahead, for `PATIENCE`, says that the line carries more."""
MIN_STABLE_US = 3_000_000
SLOW_FRAME_US = 50_000
SLOW_DECODE_US = 20_000
BLOCK_BANDWIDTH_SHARE = 0.8
"""Of a narrow line that blocks may take."""
BLOCK_BANDWIDTH_SHARE_WITH_OVERLAYS = 0.1
"""The same while limbs are pulled: hands that are late are seen sooner than a coarser dance."""
THROUGHPUT_TIME_CONSTANT_US = 3_000_000
"""What a line carries is its mean over about this time, microseconds,"""
SLOWDOWN_RATIO = 0.7
"""but beside hands one that carries less than this share of it counts as slower at once: they would wait."""


class BitrateSelector:
    """The rate of one viewer, from the reports it sends each second and what its line carries; times are clock times in
    microseconds.

    `rate` is a step of how motion and sound share the line (`sharing`), and `reason` one of `best` (the highest there
    is), `line` (it carries no more), `hands` (pulled limbs go before a finer dance), `machine` (frames or blocks take
    the viewer too long), `buffer` (too little was ready ahead), `start` (more is tried once this goes well), `hidden`
    (a tab that nobody sees), `pinned` (the viewer asked for it).
    """

    def __init__(
        self,
        level_count: int,
        pinned: int | None = None,
        initial: int | None = None,
        fallback: int = 0,
        bitrates_kbps: Sequence[float] = (),
    ) -> None:
        """`first` is the rate to begin with, if not the highest; `safe` the one of who does not look or cannot keep up
        with more: a line that does not carry it gets less; `costs` are the rates' in kbit/s, lowest first: without them
        what the line carries says nothing."""
        self._max_level = level_count - 1
        self._fallback_level = fallback
        self._is_pinned = pinned is not None
        begun = pinned if pinned is not None else initial if initial is not None else self._max_level
        self._target_level = min(max(begun, 0), self._max_level)
        self._bitrates_kbps = bitrates_kbps
        self._changed_at: int | None = None
        self._in_background = False
        self._lowered_reason = "start"
        self._throughput: float | None = None
        self._throughput_at = 0
        self._throughput_level = self._max_level
        self._shares_with_overlays = False

    @property
    def level(self) -> int:
        """The rate now."""
        if self._is_pinned:
            return self._target_level
        rate = min(self._target_level, self._throughput_level)
        return min(self._fallback_level, rate) if self._in_background else rate

    @property
    def reason(self) -> str:
        """Why, in one word of `Choice`."""
        if self._is_pinned:
            return "pinned"
        if self._in_background:
            return "hidden"
        if self._throughput_level < self._target_level:
            return "hands" if self._shares_with_overlays else "line"
        return self._lowered_reason if self._target_level < self._max_level else "best"

    @property
    def throughput_bps(self) -> int | None:
        """What the line carries with all heads, bit/s to the nearest 100, None where it is not narrow."""
        return None if self._throughput is None else round(self._throughput * 8 / 100) * 100

    def update_throughput(self, throughput: float | None, clock: int, shares_with_overlays: bool) -> None:
        """A narrow line carries so many bytes a second, heads included; None where it is not narrow. `beside` says that
        pulled limbs share it."""
        if throughput is None or not self._bitrates_kbps:
            self._throughput, self._throughput_level = None, self._max_level
            return
        if self._throughput is None or (shares_with_overlays and throughput < SLOWDOWN_RATIO * self._throughput):
            self._throughput = throughput
        else:
            self._throughput += (throughput - self._throughput) * -math.expm1(
                -max(clock - self._throughput_at, 0) / THROUGHPUT_TIME_CONSTANT_US
            )
        self._throughput_at, self._shares_with_overlays = clock, shares_with_overlays
        # a block that is on its way when the line becomes slow keeps all else waiting: no more than it carries now
        share = min(self._throughput, throughput) * (
            BLOCK_BANDWIDTH_SHARE_WITH_OVERLAYS if shares_with_overlays else BLOCK_BANDWIDTH_SHARE
        )
        best = max((n for n, kbps in enumerate(self._bitrates_kbps) if kbps * 125 + HEADER_BYTES <= share), default=0)
        # a rate that was left is taken again only when there is some room to spare
        if best <= self._throughput_level or self._bitrates_kbps[best] * 125 + HEADER_BYTES <= share * 0.9:
            self._throughput_level = best

    def process_report(self, report: Report, clock: int) -> int:
        """Take in a viewer's report; the rate from now on."""
        if self._is_pinned:
            return self.level
        if report.hidden != self._in_background:
            # its own rate is kept for when it is seen again
            self._in_background = report.hidden
            self._changed_at = clock
        if self._in_background:
            return self.level
        if self._changed_at is None:
            self._changed_at = clock
        settled = clock - self._changed_at
        struggling = report.frame > SLOW_FRAME_US or report.decode > SLOW_DECODE_US
        if report.buffer < LOW_BUFFER_US and settled >= 1_000_000:
            self._lowered_reason = "buffer"
            self._change_level(-1, clock)
        elif struggling and settled >= 1_000_000:
            if self.level > self._fallback_level:
                self._lowered_reason = "machine"
                self._change_level(-1, clock)
        elif report.buffer >= HIGH_BUFFER_US and not struggling and settled >= MIN_STABLE_US:
            self._change_level(1, clock)
        return self.level

    def _change_level(self, delta: int, clock: int) -> None:
        self._target_level = min(max(self._target_level + delta, 0), self._max_level)
        self._changed_at = clock
