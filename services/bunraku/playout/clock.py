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

SAMPLES = 32
DRIFT = 200e-6
"""Microseconds a microsecond that two clocks may go apart."""
CLOSING = 250_000
"""The shown offset closes on the best one with this time constant, microseconds."""
SLEW = 0.9
"""It moves by this at most, microseconds a microsecond: shown time never stands or runs back."""
STEP = 1_000_000
"""Further off than this, at the start or after a pause of the machine, the clock is set anew."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One round trip: reference minus local `offset`, the time on the way, `trip`, and when it came, `at` on the local
    clock; microseconds."""

    offset: float
    trip: int
    at: int = 0

    def error(self, now: int) -> float:
        """How far the offset may be off at `now`."""
        return self.trip / 2 + DRIFT * (now - self.at)


class ReferenceClock:
    """Local time to reference time. All arguments and results are microseconds."""

    def __init__(self) -> None:
        self._samples: deque[Sample] = deque(maxlen=SAMPLES)
        self._low = self._high = 0.0
        self._shown = 0.0
        self._shown_at: int | None = None

    def pong(self, sent: int, received: int, answered: int, arrived: int) -> None:
        """Take in an answer: `sent` and `arrived` on the local clock, `received` and `answered` on the reference clock.

        An answer that took less than no time is ignored.
        """
        trip = (arrived - sent) - (answered - received)
        if trip < 0 or answered < received:
            return
        self._samples.append(Sample(((received - sent) + (answered - arrived)) / 2, trip, arrived))
        self._bound(arrived)
        if self._shown_at is None or abs(self.offset - self._shown) > STEP:
            self._shown, self._shown_at = self.offset, arrived

    def guess(self, reference: int, local: int) -> None:
        """A first idea of the time, from a message that said it: used until an answer says it well."""
        if self._shown_at is None:
            self._shown, self._shown_at = float(reference - local), local

    @property
    def ready(self) -> bool:
        """Whether an answer has come yet."""
        return bool(self._samples)

    @property
    def offset(self) -> float:
        """Reference minus local, as far as the samples say."""
        return (self._low + self._high) / 2 if self._samples else 0.0

    @property
    def error(self) -> float:
        """How far the offset may be off at most, when the last answer came."""
        return (self._high - self._low) / 2 if self._samples else float("inf")

    def restart(self) -> None:
        """A new connection, perhaps to another machine: older answers say nothing about it. The offset in use stays."""
        self._samples.clear()

    def _bound(self, now: int) -> None:
        while True:
            self._low = max(sample.offset - sample.error(now) for sample in self._samples)
            self._high = min(sample.offset + sample.error(now) for sample in self._samples)
            if self._low <= self._high or len(self._samples) == 1:
                return
            # a clock was set anew: what was said before is no longer true
            self._samples.popleft()

    @property
    def shown_offset(self) -> float:
        """The offset in use: on its way to `offset`."""
        return self._shown

    def at(self, local: int) -> int:
        """The reference time at `local`; calls come in order of time."""
        if self._samples and self._shown_at is not None and local > self._shown_at:
            passed = local - self._shown_at
            closed = (self.offset - self._shown) * -math.expm1(-passed / CLOSING)
            self._shown += min(max(closed, -SLEW * passed), SLEW * passed)
            self._shown_at = local
        return round(local + self._shown)
