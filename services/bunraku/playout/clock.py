"""Reference clock as estimated at this end of a connection.

Ping and Pong have the same size, so both directions take equally long on a constrained link. Each round trip bounds the
offset: it is wrong by at most half the round trip, plus the drift since then. The estimate is the middle of the
intersection of these bounds (Marzullo and Owicki 1983): a sample with a fast outward way and another with a fast return
complement each other. The offset in use slews towards the estimate and never steps, so the picture does not jump.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

MAX_SAMPLES = 32
MAX_CLOCK_DRIFT = 200e-6
"""Upper bound of the drift between two clocks, microseconds per microsecond."""
SLEW_TIME_CONSTANT_US = 250_000
"""Time constant with which the offset in use approaches the estimate, microseconds."""
MAX_SLEW_RATE = 0.9
"""Upper bound of the slew, microseconds per microsecond: time in use never stops or runs backwards."""
RESET_THRESHOLD_US = 1_000_000
"""An offset that is wrong by more, at the start or after the machine was suspended, is stepped, microseconds."""


@dataclass(frozen=True, slots=True)
class ClockSample:
    """Measurement of one round trip; microseconds."""

    offset: float
    """Reference time minus local time."""
    round_trip_us: int
    received_at: int = 0
    """Local time at which the answer was received."""

    def error_bound(self, now: int) -> float:
        """Return the maximum error of the offset at local time `now`."""
        return self.round_trip_us / 2 + MAX_CLOCK_DRIFT * (now - self.received_at)


class ReferenceClock:
    """Conversion of local time to reference time. All arguments and results are microseconds."""

    def __init__(self) -> None:
        self._samples: deque[ClockSample] = deque(maxlen=MAX_SAMPLES)
        self._min_offset = self._max_offset = 0.0
        self._slewed_offset = 0.0
        self._slewed_at: int | None = None

    def add_sample(self, sent: int, received: int, answered: int, arrived: int) -> None:
        """Add a Pong: `sent` and `arrived` are local times, `received` and `answered` reference times.

        An answer with a negative round trip is ignored.
        """
        trip = (arrived - sent) - (answered - received)
        if trip < 0 or answered < received:
            return
        self._samples.append(ClockSample(((received - sent) + (answered - arrived)) / 2, trip, arrived))
        self._update_bounds(arrived)
        if self._slewed_at is None or abs(self.offset - self._slewed_offset) > RESET_THRESHOLD_US:
            self._slewed_offset, self._slewed_at = self.offset, arrived

    def set_estimate(self, reference: int, local: int) -> None:
        """Set the offset from a message that holds the reference time; it is used until the first sample."""
        if self._slewed_at is None:
            self._slewed_offset, self._slewed_at = float(reference - local), local

    @property
    def is_synchronised(self) -> bool:
        """True once a sample was added."""
        return bool(self._samples)

    @property
    def offset(self) -> float:
        """Estimate of reference time minus local time."""
        return (self._min_offset + self._max_offset) / 2 if self._samples else 0.0

    @property
    def error_bound(self) -> float:
        """Maximum error of the offset at the time of the last sample."""
        return (self._max_offset - self._min_offset) / 2 if self._samples else float("inf")

    def restart(self) -> None:
        """Discard the samples after a reconnect, perhaps to another machine; the offset in use stays."""
        self._samples.clear()

    def _update_bounds(self, now: int) -> None:
        while True:
            self._min_offset = max(sample.offset - sample.error_bound(now) for sample in self._samples)
            self._max_offset = min(sample.offset + sample.error_bound(now) for sample in self._samples)
            if self._min_offset <= self._max_offset or len(self._samples) == 1:
                return
            # the bounds contradict each other: a clock was stepped, and older samples are invalid
            self._samples.popleft()

    @property
    def slewed_offset(self) -> float:
        """Offset in use, which approaches `offset`."""
        return self._slewed_offset

    def at(self, local: int) -> int:
        """Return the reference time at `local`; calls must be in order of time."""
        if self._samples and self._slewed_at is not None and local > self._slewed_at:
            elapsed = local - self._slewed_at
            correction = (self.offset - self._slewed_offset) * -math.expm1(-elapsed / SLEW_TIME_CONSTANT_US)
            self._slewed_offset += min(max(correction, -MAX_SLEW_RATE * elapsed), MAX_SLEW_RATE * elapsed)
            self._slewed_at = local
        return round(local + self._slewed_offset)
