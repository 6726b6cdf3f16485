"""Order of captured frames: duplicates and stale frames dropped, strictly increasing sample times on the local clock.

A frame that follows the last one by about the usual interval is released at once. After a gap, frames wait for the
missing one as long as frames were late recently, at most `MAX_WAIT_S`. On a network that does not reorder nothing
waits, whatever it loses.
"""

from __future__ import annotations

import heapq
from collections import deque
from dataclasses import dataclass

from bunraku.capture.frame import CapturedFrame
from bunraku.capture.sender_clock import ArrivalClock, SenderClock
from bunraku.marionette.solver.vector import Quaternion

MAX_WAIT_S = 0.1
"""Longest wait for a missing frame."""
WAIT_MARGIN = 1.25
"""Wait for a missing frame, as a multiple of the lateness observed."""
WAIT_DECAY_S = 10.0
"""Time constant with which observed lateness is forgotten."""
GAP_FACTOR = 1.5
"""Interval, as a multiple of the usual one, from which a frame counts as missing."""
PERIOD_GAIN = 0.1
MAX_GAP_S = 0.5
"""Longest interval in which frames count as missing: after it the sender has paused."""
MAX_WAITING_FRAMES = 64
RECENT_FRAMES = 256
"""Frames remembered to recognise duplicates."""
MIN_INTERVAL_S = 1e-4
"""Frames closer in time count as one."""


@dataclass(frozen=True, slots=True)
class TimedFrame:
    """Frame with its sample time on the local clock, seconds."""

    time_s: float
    frame: CapturedFrame


@dataclass(slots=True)
class ReorderStatistics:
    """Frames released, frames dropped because they were duplicates or too late, and frames that never arrived.

    `missing` is an estimate from the usual interval.
    """

    released: int = 0
    duplicates: int = 0
    late: int = 0
    missing: int = 0


class ReorderBuffer:
    """Buffer of captured frames, driven by arrival times."""

    def __init__(self) -> None:
        self.statistics = ReorderStatistics()
        self._sender_clock = SenderClock()
        self._arrival_clock = ArrivalClock()
        # sample time, order of arrival, arrival time, frame
        self._waiting: list[tuple[float, int, float, CapturedFrame]] = []
        self._arrivals = 0
        self._recent: deque[tuple[float | None, int | None, dict[str, Quaternion]]] = deque(maxlen=RECENT_FRAMES)
        self._releases: deque[tuple[float, float]] = deque(maxlen=RECENT_FRAMES)
        self._period_s: float | None = None
        self._wait_s = 0.0
        self._now_s: float | None = None

    def push(self, frame: CapturedFrame, arrival_s: float) -> list[TimedFrame]:
        """Return the frames that are released when `frame` arrives."""
        self._advance(arrival_s)
        if frame.sender_time_s is not None or frame.sequence is not None:
            # coarse times may repeat, but not with the same pose
            key = (frame.sender_time_s, frame.sequence, frame.rotations)
            if key in self._recent:
                self.statistics.duplicates += 1
                return self.poll(arrival_s)
            self._recent.append(key)
        if frame.sender_time_s is not None:
            time_s = self._sender_clock.to_local(
                frame.sender_time_s, arrival_s, frame.sequence, frame.time_resolution_s
            )
        else:
            time_s = self._arrival_clock.to_local(arrival_s)
        if self._releases and time_s < self._releases[-1][0] + MIN_INTERVAL_S:
            self.statistics.late += 1
            self._note_lateness(time_s, arrival_s)
        else:
            heapq.heappush(self._waiting, (time_s, self._arrivals, arrival_s, frame))
            self._arrivals += 1
        return self.poll(arrival_s)

    def poll(self, now_s: float) -> list[TimedFrame]:
        """Return the frames that are released at `now_s` without another arrival."""
        self._advance(now_s)
        released: list[TimedFrame] = []
        while self._waiting and (self._is_next() or now_s >= self._deadline_s()):
            time_s, _, _, frame = heapq.heappop(self._waiting)
            if self._releases and time_s < self._releases[-1][0] + MIN_INTERVAL_S:
                self.statistics.duplicates += 1
                continue
            self._note_period(time_s)
            self._releases.append((time_s, now_s))
            self.statistics.released += 1
            released.append(TimedFrame(time_s, frame))
        return released

    @property
    def deadline_s(self) -> float | None:
        """Time at which `poll` releases the next frame, None if nothing waits."""
        return self._deadline_s() if self._waiting else None

    def _deadline_s(self) -> float:
        return self._waiting[0][2] + self._wait_s

    def _is_next(self) -> bool:
        """Return whether no frame is missing before the first one that waits."""
        if len(self._waiting) > MAX_WAITING_FRAMES or not self._releases or self._period_s is None:
            return True
        return self._waiting[0][0] - self._releases[-1][0] <= GAP_FACTOR * self._period_s

    def _advance(self, now_s: float) -> None:
        """Forget observed lateness with time."""
        if self._now_s is not None and now_s > self._now_s:
            self._wait_s *= max(0.0, 1.0 - (now_s - self._now_s) / WAIT_DECAY_S)
        self._now_s = now_s if self._now_s is None else max(now_s, self._now_s)

    def _note_lateness(self, time_s: float, arrival_s: float) -> None:
        """Wait longer from now on: a frame arrived after a later one was released."""
        overtaken_s = next((at for sampled, at in self._releases if sampled >= time_s), arrival_s)
        self._wait_s = min(max(self._wait_s, WAIT_MARGIN * (arrival_s - overtaken_s)), MAX_WAIT_S)

    def _note_period(self, time_s: float) -> None:
        if not self._releases:
            return
        interval_s = time_s - self._releases[-1][0]
        if self._period_s is None:
            self._period_s = interval_s
        elif interval_s <= GAP_FACTOR * self._period_s:
            self._period_s += PERIOD_GAIN * (interval_s - self._period_s)
        else:
            if interval_s <= MAX_GAP_S:
                self.statistics.missing += round(interval_s / self._period_s) - 1
            # gaps count little, so that loss does not stretch the period, but a slower sender is followed
            self._period_s *= 1.0 + 0.1 * PERIOD_GAIN
