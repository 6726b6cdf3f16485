"""How much a sender may have on its way over a line, so that what is newest does not wait behind what is old.

A narrow line keeps what it cannot send yet in a queue, and TCP fills it. So a window of unacknowledged bytes is kept
such that about `QUEUED` bytes wait in the queue: once a round trip it is corrected by what is too much or too
little in the queue (as in FAST TCP, Wei, Jin, Low and Hegde 2006). Of the round trips of that time the shortest counts,
as receivers take their time to acknowledge. What the line carries is told by Little's law: what was on its way when a
message was written, over the time until that was acknowledged; of the last second the most counts, as a line that is
not filled tells less. Bytes are those of the line: every message is a packet and pays for its heads. Times are
microseconds of any clock that does not run backwards.
"""

from __future__ import annotations

from collections import deque

HEADS = 54
"""Bytes of heads that a message costs on the line: IPv4, TCP with time stamps, and a WebSocket frame's."""
PACKET = 1_400
"""Of a longer message each such part is a packet."""
DELAYED = 40_000
"""A receiver waits so long before it acknowledges, microseconds."""
QUEUED = 220
"""Bytes that are to wait in the line's queue: a message or two."""
LEAST = 1_600
"""The window before anything is known: a first block, its Description, and some more."""
LARGE = 250
"""Bytes of a message that is not large."""
STEP = 60.0
"""Bytes that a window grows by at least, where it is too small."""
WATCHED = 30_000
"""A round trip counts only if its end was looked out for as often as this."""
REMEMBERED = 1_000_000
"""What the line carried in this time counts."""
FORGET = 10_000_000
"""So long after its queue was last seen filled a line counts as narrow."""


def on_line(size: int) -> int:
    """Bytes that a message of `size` bytes takes on the line."""
    return size + HEADS * (1 + max(size - 1, 0) // PACKET)


class Window:
    """The window of one line: told what was written and how much of it was acknowledged."""

    def __init__(self) -> None:
        self.limit = float(LEAST)
        """Bytes that may be on their way."""
        self.base: int | None = None
        """The least time from writing to acknowledgement so far."""
        self.rate: float | None = None
        """Bytes a second that the line carries, or carried at least while it was never full."""
        self.full_at: int | None = None
        """When the line's queue was last seen to be filled."""
        self._written = 0
        self._line_written = 0
        self._line_acknowledged = 0
        # of what is on its way: end in bytes written, end in bytes on the line, when, and what was on its way then
        self._flying: deque[tuple[int, int, int, int]] = deque()
        self._rates: deque[tuple[int, float]] = deque()
        self._looked = 0
        self._limited = False
        # the present round trip: since when, and the shortest in it
        self._turn = 0
        self._took: int | None = None

    @property
    def flying(self) -> int:
        """Bytes of the line that are not acknowledged yet."""
        return self._line_written - self._line_acknowledged

    @property
    def late(self) -> float:
        """How much later than they could acknowledgements are to come, microseconds."""
        return DELAYED + (QUEUED / self.rate * 1e6 if self.rate else 0.0)

    def wrote(self, at: int, size: int) -> None:
        """`size` bytes were written at once at `at`."""
        self._written += size
        self._line_written += on_line(size)
        self._flying.append((self._written, self._line_written, at, self.flying))

    def acknowledged(self, at: int, waiting: int, least: int | None = None) -> None:
        """At `at`, of all that was written the last `waiting` bytes are not acknowledged yet; `least` is the shortest
        round trip that the system knows of, if it tells."""
        done = self._written - max(waiting, 0)
        looked, self._looked = self._looked, at
        newest = None
        while self._flying and self._flying[0][0] <= done:
            newest = self._flying.popleft()
            self._line_acknowledged = newest[1]
        if newest is None:
            return
        _, _, written, flying = newest
        took = max(at - written, 1)
        self.base = min(time for time in (self.base, least, took) if time)
        if at - max(looked, written) <= WATCHED:
            self._heed(at, took, flying, written)

    def _heed(self, at: int, took: int, flying: int, written: int) -> None:
        """What was written at `written` with `flying` on its way took so long."""
        assert self.base is not None
        self._rates.append((at, flying * 1e6 / took))
        while at - self._rates[0][0] > REMEMBERED:
            self._rates.popleft()
        self.rate = max(rate for _, rate in self._rates)
        if took - self.base > self.late:
            self.full_at = at
        if flying <= self.limit + LARGE:
            # else it was behind something larger than the window
            self._took = min(self._took or took, took)
            if took - self.base > 2 * self.late:
                # the line has become slower
                self.limit = min(self.limit, self.rate * (self.base + self.late) * 1e-6)
        if written < self._turn:
            return
        # a round trip has passed: this was written after the last turn
        if self._took is not None:
            queued = self._took - self.base
            if queued > self.late:
                self.limit *= (self.base + self.late) / self._took
            elif self._limited:
                self.limit += max(self.limit * 0.5 * (1.0 - queued / self.late), STEP)
        self.limit = max(self.limit, float(LARGE))
        self._turn, self._took, self._limited = at, None, False

    def room(self, at: int) -> bool:
        """Whether something may be written at `at`: always when nothing is on its way."""
        if not self._flying:
            return True
        if self.flying >= self.limit:
            self._limited = True
            return False
        # nothing came back for long: the line has become slower, or stands
        return self.base is None or at - self._flying[0][2] <= self.base + 2 * self.late

    def wait(self) -> int:
        """Microseconds after which there may be room."""
        if self.rate is None or self.rate <= 0.0:
            return 20_000
        return round(min(max((self.flying - self.limit) / self.rate * 1e6, 5_000.0), 20_000.0))

    def narrow(self, at: int) -> bool:
        """Whether the line's queue was filled of late."""
        return self.full_at is not None and at - self.full_at < FORGET
