"""Sample times of captured frames on the local clock.

Frames carry times of the sender's clock, whose offset and drift are unknown, and arrive with a variable delay. The
fastest datagrams show the offset. It may rise by the drift that two clocks may have and is slewed, never stepped, so
that a movement keeps its speed. Cf. NTP's clock filter (RFC 5905, 10), which also prefers the samples of least delay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

MAX_DRIFT = 200e-6
"""Drift that two clocks may have."""
MAX_SLEW = 500e-6
"""Largest change of the offset per second, after `SETTLING_S`."""
SETTLING_S = 1.0
"""Time after the start in which the offset follows its estimate at once."""
MAX_BACKWARD_S, MAX_DELAY_S = 0.5, 2.0
"""A frame earlier or later than expected by more than these shows that the sender's clock was set anew."""
FINE_RESOLUTION_S = 1e-4
"""Times of a finer resolution are not smoothed."""
FIT_FRAMES, MIN_FIT_FRAMES = 64, 8
"""Most and fewest frames over which coarse times are smoothed."""
SEQUENCE_RANGE = 1 << 32

INITIAL_FRAMES = 16
"""Frames after which the frame rate of a sender without times is known."""
PERIOD_RANGE_S = (1e-3, 0.5)
_ARRIVAL_GAIN, _PERIOD_GAIN = 0.1, 0.005
"""Gains of the loop that smooths arrival times: damping near 0.7, settling in some 50 frames."""


class SenderClock:
    """Conversion of the sender's times to the local clock, from the arrivals of frames.

    Coarse times of a steady sender are smoothed: a sender of 60 frames/s with whole milliseconds, as MVN's, would
    otherwise have intervals of 16 and 17 ms; the 32-bit seconds of VMC are multiples of 2 ms after five hours.
    """

    def __init__(self) -> None:
        self._start_s = 0.0
        self._newest_s = 0.0
        self._least_delay_s: float | None = None
        self._offset_s = 0.0
        self._counted: deque[tuple[int, float]] = deque(maxlen=FIT_FRAMES)

    def to_local(
        self, sender_s: float, arrival_s: float, sequence: int | None = None, resolution_s: float = 0.0
    ) -> float:
        """Return the sample time, on the local clock, of a frame with the sender's time and frame counter."""
        if resolution_s > FINE_RESOLUTION_S:
            sender_s = self._smooth_time(sender_s, sequence, resolution_s)
        delay_s = arrival_s - sender_s
        expected = self._least_delay_s
        if expected is None or not -MAX_BACKWARD_S <= delay_s - expected <= MAX_DELAY_S:
            self._start_s = self._newest_s = sender_s
            self._least_delay_s = self._offset_s = delay_s
            self._counted.clear()
        else:
            elapsed_s = max(0.0, sender_s - self._newest_s)
            self._newest_s += elapsed_s
            self._least_delay_s = min(expected + MAX_DRIFT * elapsed_s, delay_s)
            correction_s = self._least_delay_s - self._offset_s
            if self._newest_s - self._start_s > SETTLING_S:
                bound_s = MAX_SLEW * elapsed_s
                correction_s = min(max(correction_s, -bound_s), bound_s)
            self._offset_s += correction_s
        return sender_s + self._offset_s

    def _smooth_time(self, sender_s: float, sequence: int | None, resolution_s: float) -> float:
        """Return the time on the line through the last frames' counters and times, if it agrees with them."""
        count = self._count_frame(sender_s, sequence)
        if not self._counted or count > self._counted[-1][0]:
            self._counted.append((count, sender_s))
        fitted_s = _fit_line(self._counted, count)
        if abs(fitted_s - sender_s) <= resolution_s:
            return fitted_s
        # not a steady sender, or frames were counted wrongly
        self._counted.clear()
        return sender_s

    def _count_frame(self, sender_s: float, sequence: int | None) -> int:
        """Return the number of a frame: its counter continued beyond its range, else by the time since the last."""
        if not self._counted:
            return sequence or 0
        newest, newest_s = self._counted[-1]
        if sequence is not None:
            return newest + (sequence - newest + SEQUENCE_RANGE // 2) % SEQUENCE_RANGE - SEQUENCE_RANGE // 2
        if len(self._counted) < MIN_FIT_FRAMES:
            return newest + 1
        oldest, oldest_s = self._counted[0]
        period_s = (newest_s - oldest_s) / (newest - oldest)
        return newest + round(min((sender_s - newest_s) / period_s, 1e6)) if period_s > 0.0 else newest + 1


def _fit_line(points: Sequence[tuple[int, float]], x: int) -> float:
    """Return the value at `x` of the least-squares line through `points`, which are not empty."""
    mean_x = sum(p for p, _ in points) / len(points)
    mean_y = sum(q for _, q in points) / len(points)
    spread = sum((p - mean_x) ** 2 for p, _ in points)
    if spread == 0.0:
        return mean_y
    slope = sum((p - mean_x) * (q - mean_y) for p, q in points) / spread
    return mean_y + slope * (x - mean_x)


class ArrivalClock:
    """Sample times of frames without sender's time: arrivals, smoothed on the assumption of a constant frame rate."""

    def __init__(self) -> None:
        self._sample_s = 0.0
        self._period_s: float | None = None
        self._first_s: list[float] = []

    def to_local(self, arrival_s: float) -> float:
        """Return the sample time of a frame that arrived at `arrival_s`."""
        if self._first_s and not -MAX_BACKWARD_S <= arrival_s - self._sample_s <= MAX_DELAY_S:
            self._first_s, self._period_s = [], None
        if self._period_s is None:
            self._sample_s = arrival_s
            self._first_s.append(arrival_s)
            if len(self._first_s) >= INITIAL_FRAMES:
                intervals = sorted(b - a for a, b in pairwise(self._first_s))
                self._period_s = min(max(intervals[len(intervals) // 2], PERIOD_RANGE_S[0]), PERIOD_RANGE_S[1])
            return arrival_s
        steps = max(1, round((arrival_s - self._sample_s) / self._period_s))
        predicted_s = self._sample_s + steps * self._period_s
        error_s = arrival_s - predicted_s
        self._sample_s = max(predicted_s + _ARRIVAL_GAIN * error_s, self._sample_s + PERIOD_RANGE_S[0])
        period_s = self._period_s + _PERIOD_GAIN * error_s / steps
        self._period_s = min(max(period_s, PERIOD_RANGE_S[0]), PERIOD_RANGE_S[1])
        return self._sample_s
