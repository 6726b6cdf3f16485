"""How much a sender may have on its way over a line, so that what is newest does not wait behind what is old.

A narrow line keeps what it cannot send yet in a queue, and TCP fills it. So a window of unacknowledged bytes is kept
such that the queue holds about `QUEUE` of time: the window grows with what is acknowledged while answers come as soon as
they can, and goes back to what the line carries once they come late (as TCP Vegas, Brakmo and Peterson 1995, and BBR's
bandwidth-delay product, Cardwell et al. 2016). Bytes are those of the line: every message is a packet and pays for its
heads. Times are microseconds of any clock that does not run backwards.
"""

from __future__ import annotations

from collections import deque

HEADS = 54
"""Bytes of heads that a message costs on the line: IPv4, TCP with time stamps, and a WebSocket frame's."""
PACKET = 1_400
"""Of a longer message each such part is a packet."""
QUEUE = 100_000
"""What may wait in the line's queue, and an acknowledgement with the receiver, microseconds."""
LEAST = 1_200
"""The window before anything is known: a first block, its Description, and some more."""
SLOPE = 400_000
"""The line's rate is told over this time, microseconds."""
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
        # of what is on its way: end in bytes written, end in bytes on the line, and when it was written
        self._flying: deque[tuple[int, int, int]] = deque()
        # acknowledged bytes of the line over the last time: instants and totals
        self._slope: deque[tuple[int, int]] = deque()
        self._limited = False

    @property
    def flying(self) -> int:
        """Bytes of the line that are not acknowledged yet."""
        return self._line_written - self._line_acknowledged

    def wrote(self, at: int, size: int) -> None:
        """`size` bytes were written at once at `at`."""
        if not self._flying:
            # a slope begins where something is on its way again
            self._slope.clear()
            self._slope.append((at, self._line_acknowledged))
        self._written += size
        self._line_written += on_line(size)
        self._flying.append((self._written, self._line_written, at))

    def acknowledged(self, at: int, waiting: int, least: int | None = None) -> None:
        """At `at`, of all that was written the last `waiting` bytes are not acknowledged yet; `least` is the shortest
        round trip that the system knows of, if it tells."""
        done = self._written - max(waiting, 0)
        newest: int | None = None
        while self._flying and self._flying[0][0] <= done:
            _, self._line_acknowledged, newest = self._flying.popleft()
        if newest is None:
            return
        took = max(at - newest, 1)
        known = [time for time in (self.base, least, took) if time is not None and time > 0]
        self.base = min(known)
        gained = self._line_acknowledged - self._slope[-1][1] if self._slope else 0
        self._slope.append((at, self._line_acknowledged))
        while len(self._slope) > 2 and at - self._slope[1][0] >= SLOPE:
            self._slope.popleft()
        self._heed(at, took - self.base, gained)

    def _heed(self, at: int, queued: int, gained: int) -> None:
        """Acknowledgements came `queued` later than they could, of `gained` bytes."""
        begun, before = self._slope[0]
        slope = (self._line_acknowledged - before) * 1e6 / max(at - begun, 1)
        if queued > QUEUE // 2:
            self.full_at = at
            if at - begun >= SLOPE // 2:
                self.rate = slope
            if queued > QUEUE and self.rate is not None:
                self.limit = max(self.carried, float(HEADS))
        else:
            if self.rate is None or slope > self.rate:
                self.rate = slope
            if self._limited:
                self.limit += gained
        self._limited = False

    @property
    def carried(self) -> float:
        """Bytes that the line carries in a round trip and `QUEUE`."""
        assert self.base is not None
        assert self.rate is not None
        return self.rate * (self.base + QUEUE) * 1e-6

    def room(self, at: int) -> bool:
        """Whether something may be written at `at`: always when nothing is on its way."""
        if not self._flying:
            return True
        late = self.base is not None and at - self._flying[0][2] > self.base + 2 * QUEUE
        if self.flying >= self.limit or late:
            self._limited = True
            return False
        return True

    def wait(self) -> int:
        """Microseconds after which there may be room."""
        if self.rate is None or self.rate <= 0.0:
            return 20_000
        return round(min(max((self.flying - self.limit) / self.rate * 1e6, 5_000.0), 20_000.0))

    def narrow(self, at: int) -> bool:
        """Whether the line's queue was filled of late."""
        return self.full_at is not None and at - self.full_at < FORGET
