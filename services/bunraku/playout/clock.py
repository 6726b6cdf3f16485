"""The reference clock as seen from this end of a line.

Pings and pongs are of equal size, so on a narrow line both ways take equally long to send. Each answer says between
which bounds the offset lies: it is off by half its round trip at most, and by what the clocks have drifted since. The
offset is the middle of what the last samples leave (Marzullo and Owicki 1983): one that waited least on its way there
and another that waited least on its way back say it together. What is shown slews towards it and never steps, so the
picture does not jump.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

MAX_SAMPLES = 32
MAX_CLOCK_DRIFT = 200e-6
"""Microseconds a microsecond that two clocks may go apart."""
SLEW_TIME_CONSTANT_US = 250_000
"""The shown offset closes on the best one with this time constant, microseconds."""
MAX_SLEW_RATE = 0.9
"""It moves by this at most, microseconds a microsecond: shown time never stands or runs back."""
RESET_THRESHOLD_US = 1_000_000
"""Further off than this, at the start or after a pause of the machine, the clock is set anew."""


@dataclass(frozen=True, slots=True)
class ClockSample:
    """One round trip: reference minus local `offset`, the time on the way, `trip`, and when it came, `at` on the local
    clock; microseconds."""

    offset: float
    round_trip_us: int
    received_at: int = 0

    def error_bound(self, now: int) -> float:
        """How far the offset may be off at `now`."""
        return self.round_trip_us / 2 + MAX_CLOCK_DRIFT * (now - self.received_at)


class ReferenceClock:
    """Local time to reference time. All arguments and results are microseconds."""

    def __init__(self) -> None:
        self._samples: deque[ClockSample] = deque(maxlen=MAX_SAMPLES)
        self._min_offset = self._max_offset = 0.0
        self._slewed_offset = 0.0
        self._slewed_at: int | None = None

    def add_sample(self, sent: int, received: int, answered: int, arrived: int) -> None:
        """Take in an answer: `sent` and `arrived` on the local clock, `received` and `answered` on the reference clock.

        An answer that took less than no time is ignored.
        """
        trip = (arrived - sent) - (answered - received)
        if trip < 0 or answered < received:
            return
        self._samples.append(ClockSample(((received - sent) + (answered - arrived)) / 2, trip, arrived))
        self._update_bounds(arrived)
        if self._slewed_at is None or abs(self.offset - self._slewed_offset) > RESET_THRESHOLD_US:
            self._slewed_offset, self._slewed_at = self.offset, arrived

    def set_estimate(self, reference: int, local: int) -> None:
        """A first idea of the time, from a message that said it: used until an answer says it well."""
        if self._slewed_at is None:
            self._slewed_offset, self._slewed_at = float(reference - local), local

    @property
    def is_synchronised(self) -> bool:
        """Whether an answer has come yet."""
        return bool(self._samples)

    @property
    def offset(self) -> float:
        """Reference minus local, as far as the samples say."""
        return (self._min_offset + self._max_offset) / 2 if self._samples else 0.0

    @property
    def error_bound(self) -> float:
        """How far the offset may be off at most, when the last answer came."""
        return (self._max_offset - self._min_offset) / 2 if self._samples else float("inf")

    def restart(self) -> None:
        """A new connection, perhaps to another machine: older answers say nothing about it. The offset in use stays."""
        self._samples.clear()

    def _update_bounds(self, now: int) -> None:
        while True:
            self._min_offset = max(sample.offset - sample.error_bound(now) for sample in self._samples)
            self._max_offset = min(sample.offset + sample.error_bound(now) for sample in self._samples)
            if self._min_offset <= self._max_offset or len(self._samples) == 1:
                return
            # a clock was set anew: what was said before is no longer true
            self._samples.popleft()

    @property
    def slewed_offset(self) -> float:
        """The offset in use: on its way to `offset`."""
        return self._slewed_offset

    def at(self, local: int) -> int:
        """The reference time at `local`; calls come in order of time."""
        if self._samples and self._slewed_at is not None and local > self._slewed_at:
            passed = local - self._slewed_at
            closed = (self.offset - self._slewed_offset) * -math.expm1(-passed / SLEW_TIME_CONSTANT_US)
            self._slewed_offset += min(max(closed, -MAX_SLEW_RATE * passed), MAX_SLEW_RATE * passed)
            self._slewed_at = local
        return round(local + self._slewed_offset)
