"""Selection of a viewer's bitrate level, by its link and its machine (paper, section 2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bunraku.delivery.block_scheduler import SEND_AHEAD_US
from bunraku.delivery.congestion import HEADER_BYTES
from bunraku.wire.messages import Report

LOW_BUFFER_US = 800_000
"""A shorter buffer shows that the link does not sustain the level, microseconds."""
HIGH_BUFFER_US = SEND_AHEAD_US * 6 // 10
"""A buffer of this length for `MIN_STABLE_US` shows that the link sustains a higher level, microseconds."""
MIN_STABLE_US = 3_000_000
SLOW_FRAME_US = 50_000
SLOW_DECODE_US = 20_000
BLOCK_BANDWIDTH_SHARE = 0.8
"""Share of a constrained link's throughput that blocks may use."""
BLOCK_BANDWIDTH_SHARE_WITH_OVERLAYS = 0.1
"""That share while limbs are controlled: late overlays are more visible than a coarser motion."""
THROUGHPUT_TIME_CONSTANT_US = 3_000_000
"""Time constant of the mean throughput, microseconds."""
SLOWDOWN_RATIO = 0.7
"""While overlays share the link, a throughput below this share of the mean replaces it at once: overlays would wait."""


class BitrateSelector:
    """Level of one viewer, from its reports (one per second) and the throughput of its link.

    `level` is an index into the allocations (`bunraku.delivery.allocation`). Times are clock times in microseconds.
    `reason` is one of:

    | reason | meaning |
    |---|---|
    | `best` | the highest level |
    | `line` | the link has no throughput for a higher one |
    | `hands` | controlled limbs take precedence over a finer motion |
    | `machine` | frames or blocks take the viewer too long |
    | `buffer` | the viewer's buffer was too short |
    | `start` | a higher level is tried once this one is stable |
    | `hidden` | the page is in the background |
    | `pinned` | the viewer requested the level |
    """

    def __init__(
        self,
        level_count: int,
        pinned: int | None = None,
        initial: int | None = None,
        fallback: int = 0,
        bitrates_kbps: Sequence[float] = (),
    ) -> None:
        """Start at `initial`, or at the highest level.

        `fallback` is the level in the background, and the lowest one for a slow machine; a slow link may get less.
        `bitrates_kbps` are those of the levels, lowest first; without them the throughput has no effect.
        """
        self._max_level = level_count - 1
        self._fallback_level = fallback
        self._is_pinned = pinned is not None
        start = pinned if pinned is not None else initial if initial is not None else self._max_level
        self._target_level = min(max(start, 0), self._max_level)
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
        """Present level."""
        if self._is_pinned:
            return self._target_level
        level = min(self._target_level, self._throughput_level)
        return min(self._fallback_level, level) if self._in_background else level

    @property
    def reason(self) -> str:
        """Reason for the level, as sent in a `Choice`."""
        if self._is_pinned:
            return "pinned"
        if self._in_background:
            return "hidden"
        if self._throughput_level < self._target_level:
            return "hands" if self._shares_with_overlays else "line"
        return self._lowered_reason if self._target_level < self._max_level else "best"

    @property
    def throughput_bps(self) -> int | None:
        """Throughput of the link with headers, bit/s rounded to 100; None if the link is unconstrained."""
        return None if self._throughput is None else round(self._throughput * 8 / 100) * 100

    def update_throughput(self, throughput: float | None, clock: int, shares_with_overlays: bool) -> None:
        """Update the level from the link's throughput, bytes/s with headers; None if the link is unconstrained.

        `shares_with_overlays` is True while overlays of controlled limbs are sent.
        """
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
        # a block in flight delays all other data when the link becomes slower, so the newest measurement is a bound
        share = min(self._throughput, throughput) * (
            BLOCK_BANDWIDTH_SHARE_WITH_OVERLAYS if shares_with_overlays else BLOCK_BANDWIDTH_SHARE
        )
        best = max((n for n, kbps in enumerate(self._bitrates_kbps) if kbps * 125 + HEADER_BYTES <= share), default=0)
        # a higher level needs a margin, so that the level does not oscillate
        if best <= self._throughput_level or self._bitrates_kbps[best] * 125 + HEADER_BYTES <= share * 0.9:
            self._throughput_level = best

    def process_report(self, report: Report, clock: int) -> int:
        """Update the level from a viewer's report, and return it."""
        if self._is_pinned:
            return self.level
        if report.hidden != self._in_background:
            # the target level is kept for when the page is visible again
            self._in_background = report.hidden
            self._changed_at = clock
        if self._in_background:
            return self.level
        if self._changed_at is None:
            self._changed_at = clock
        stable_us = clock - self._changed_at
        is_slow = report.frame > SLOW_FRAME_US or report.decode > SLOW_DECODE_US
        if report.buffer < LOW_BUFFER_US and stable_us >= 1_000_000:
            self._lowered_reason = "buffer"
            self._change_level(-1, clock)
        elif is_slow and stable_us >= 1_000_000:
            if self.level > self._fallback_level:
                self._lowered_reason = "machine"
                self._change_level(-1, clock)
        elif report.buffer >= HIGH_BUFFER_US and not is_slow and stable_us >= MIN_STABLE_US:
            self._change_level(1, clock)
        return self.level

    def _change_level(self, delta: int, clock: int) -> None:
        self._target_level = min(max(self._target_level + delta, 0), self._max_level)
        self._changed_at = clock
