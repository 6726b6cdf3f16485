"""How much a sender may have on its way over a line, so that what is newest does not wait behind what is old.

A narrow line keeps what it cannot send yet in a queue, and TCP fills it. So a window of unacknowledged bytes is kept
such that about `QUEUED` bytes wait in the queue: once a round trip it is corrected by what is too much or too
little in the queue (as in FAST TCP, Wei, Jin, Low and Hegde 2006). Of the round trips of that time the shortest counts,
as receivers take their time to acknowledge. What the line carries is told by what was acknowledged between two
answers (the delivery rate of BBR, Cardwell et al. 2016, over the bytes of the line). Bytes are those of the line: every
message is a packet and pays for its heads. Times are microseconds of any clock that does not run backwards.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

HEADS = 54
"""Bytes of heads that a message costs on the line: IPv4, TCP with time stamps, and a WebSocket frame's."""
PACKET = 1_400
"""Of a longer message each such part is a packet."""
DELAYED = 40_000
"""A receiver waits so long before it acknowledges, microseconds."""
SPARE = 20_000
"""So much later than it should at the latest an acknowledgement may come, microseconds."""
RECEIVER = 60_000
"""No acknowledgement waits longer at a receiver than this, microseconds."""
SLOWER = 1.03
"""The line is taken to be so much slower than it seems: what is thought of its queue is then corrected at once."""
QUEUED = 220
"""Bytes that are to wait in the line's queue: a message or two,"""
QUEUED_TIME = 40_000
"""but no more than leave in this time, microseconds,"""
QUEUED_LEAST = 75.0
"""or than this."""
LEAST = 1_600
"""The window before anything is known: a first block, its Description, and some more."""
LARGE = 250
"""Bytes of a message that is not large."""
STEP = 60.0
"""Bytes that a window grows by at least, where it is too small."""
WATCHED = 40_000
"""A round trip counts only if its end was looked out for as often as this."""
ROUND = 190
"""Bytes that go there and back for a message and its acknowledgement."""
BRIEF = 20_000
"""What was acknowledged within less time than this says nothing of the line's rate, microseconds."""
WEIGHT = 0.3
"""Of the newest in the mean of the line's rate."""
SLOWED = 0.6
"""A line that seems to carry less than this share of what it did has become slower,"""
SLOWED_WEIGHT = 0.8
"""and the newest weighs more."""
SLOWING = 400_000
"""So long after it was last later than thought a line's queue may be too full, microseconds."""
FULL = 2_000_000
"""So long after its queue was seen filled what a line carries is known."""
PROBE = 2.0
"""A line that was not full is taken to carry so much more."""
FORGET = 10_000_000
"""So long after its queue was last seen filled a line counts as narrow."""


def on_line(size: int) -> int:
    """Bytes that a message of `size` bytes takes on the line."""
    return size + HEADS * (1 + max(size - 1, 0) // PACKET)


class _Flying(NamedTuple):
    """A message on its way: its end in bytes written and in bytes of the line, when it was written, the bytes on their
    way then (of none more than a message has), how much larger it is than a message; what was acknowledged by then, and
    since when nothing else was; and when the line is through with it, but for `Window._shift`."""

    end: int
    line_end: int
    at: int
    flying: int
    large: int
    acknowledged: int
    since: int
    through: float


class Window:
    """The window of one line: told what was written and how much of it was acknowledged."""

    def __init__(self) -> None:
        self.limit = float(LEAST)
        """Bytes that may be on their way."""
        self.base: int | None = None
        """The least time from writing to acknowledgement so far."""
        self.rate: float | None = None
        """Bytes a second that the line carries, or carried at least while it was never full."""
        self._quickest = 0.0
        self.full_at: int | None = None
        """When the line's queue was last seen to be filled."""
        self._slowed_at: int | None = None
        self._written = 0
        self._line_written = 0
        self._line_acknowledged = 0
        self._flying: deque[_Flying] = deque()
        self._answered_at = 0
        # beyond what a message has, of what is on its way; and when the line is through with it
        self._large = 0
        self._through = 0.0
        # when the line is through with all that was written, and by how much that was corrected so far
        self._end = 0.0
        self._shift = 0.0
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
        return DELAYED + self.queued

    @property
    def queued(self) -> float:
        """For how long what waits in the line's queue is to be enough, microseconds."""
        if not self.rate:
            return 0.0
        return min(QUEUED, max(self.rate * QUEUED_TIME * 1e-6, QUEUED_LEAST)) / self.rate * 1e6

    @property
    def least(self) -> float:
        """The least time from writing to acknowledgement at the present rate, microseconds: a line that has become
        slower takes longer for the same bytes."""
        assert self.base is not None
        if not self.rate or self.rate >= self._quickest:
            return self.base
        return self.base + ROUND * (1.0 / self.rate - 1.0 / self._quickest) * 1e6

    def wrote(self, at: int, size: int) -> None:
        """`size` bytes were written at once at `at`."""
        self._written += size
        large = max(on_line(size) - LARGE, 0)
        self._line_written += on_line(size)
        self._large += large
        if large and self.rate:
            # a line that was never full carries more than it was seen to
            rate = self.rate if self.full_at is not None and at - self.full_at < FULL else PROBE * self.rate
            self._through = max(self._through, at) + on_line(size) / rate * 1e6
        since = max(self._answered_at, self._flying[0].at) if self._flying else at
        if self.rate:
            self._end = max(self._end, at) + on_line(size) / self.rate * SLOWER * 1e6
        self._flying.append(
            _Flying(
                self._written, self._line_written, at, self.flying - self._large, large, self._line_acknowledged, since,
                self._end - self._shift,
            )
        )  # fmt: skip

    @property
    def written(self) -> int:
        """Bytes that were written."""
        return self._written

    def came(self, written: int) -> bool:
        """Whether the first `written` bytes are acknowledged."""
        return not self._flying or self._flying[0].end > written

    def passed(self, size: int) -> None:
        """`size` bytes were written besides; they are not counted among those on their way."""
        self._written += size

    def acknowledged(self, at: int, waiting: int, least: int | None = None) -> None:
        """At `at`, of all that was written the last `waiting` bytes are not acknowledged yet; `least` is the shortest
        round trip that the system knows of, if it tells."""
        done = self._written - max(waiting, 0)
        looked, self._looked = self._looked, at
        newest: _Flying | None = None
        while self._flying and self._flying[0].end <= done:
            newest = self._flying.popleft()
            self._line_acknowledged = newest.line_end
            self._large -= newest.large
        if newest is None:
            return
        self._answered_at = at
        if not self._large:
            self._through = at
        took = max(at - newest.at, 1)
        self.base = min(time for time in (self.base, least, took) if time)
        if self.rate:
            self._correct(at, at - (self.base - HEADS / self.rate * 1e6), newest.through + self._shift)
        if at - max(looked, newest.at) <= WATCHED:
            self._heed(at, took, newest)

    def _correct(self, at: int, left: float, thought: float) -> None:
        """At `at` it is known that the line was through with a message at `left` at the latest, and no more than
        `RECEIVER` before."""
        if thought < left - RECEIVER:
            self._slowed_at = at
        if not left - RECEIVER <= thought <= left:
            self._shift += left - thought
            self._end += left - thought

    def _heed(self, at: int, took: int, newest: _Flying) -> None:
        """What was last acknowledged took so long."""
        rate = (newest.line_end - newest.acknowledged) * 1e6 / max(at - newest.since, 1)
        late = took - self.least
        if self.rate is None:
            self.rate = rate
        elif late > self.late:
            self.rate += (WEIGHT if rate > SLOWED * self.rate else SLOWED_WEIGHT) * (rate - self.rate)
            self._quickest = max(self._quickest, self.rate)
        elif at - newest.since >= BRIEF:
            self.rate = max(self.rate, rate)
        if late > self.late:
            self.full_at = at
        if newest.flying <= self.limit + LARGE and not newest.large:
            # else it was behind something larger than the window
            self._took = min(self._took or took, took)
            if late > 2 * self.late and not self._large:
                # the line has become slower
                self.limit = min(self.limit, self.rate * (self.least + self.late) * 1e-6)
        written = newest.at
        if written < self._turn:
            return
        # a round trip has passed: this was written after the last turn
        if self._took is not None:
            queued = self._took - self.least
            if queued > self.late:
                self.limit *= (self.least + self.late) / self._took
            elif self._limited:
                self.limit += max(self.limit * 0.5 * (1.0 - queued / self.late), STEP)
        self.limit = max(self.limit, float(LARGE))
        self._turn, self._took, self._limited = at, None, False

    def room(self, at: int, ahead: int = 0) -> bool:
        """Whether something may be written at `at`: always when nothing is on its way. `ahead` is for how long more may
        wait in the line's queue, microseconds, so that it never runs dry; once what the line carries is known."""
        if not self._flying:
            return True
        ahead = ahead if self.rate else 0
        if self.rate and self.base is not None and self.narrow(at):
            # when its acknowledgement is to come at the latest
            latest = self._flying[0].through + self._shift + self.base + RECEIVER
            return at <= latest + SPARE and self._end - at <= self.queued + ahead
        # the line is through with what is large at a time that is known, once its rate is
        if self.flying - (self._large if self.rate else 0) >= self.limit + (self.rate or 0.0) * ahead * 1e-6:
            self._limited = True
            return False
        if at < self._through - ahead:
            return False
        # nothing came back for long: the line has become slower, or stands
        return self.base is None or at - self._flying[0].at <= self.least + 2 * self.late + ahead

    def busy(self, at: int) -> int:
        """Microseconds until the line will be through with all that is on its way, as far as is known."""
        if not self._flying or not self.rate or self.base is None:
            return 0
        # what was acknowledged last had left by then, and the line went on with what is first of the rest
        left = self._answered_at - self.base + HEADS / self.rate * 1e6
        return max(round(max(left, self._flying[0].at) + self.flying / self.rate * 1e6) - at, 0)

    def wait(self) -> int:
        """Microseconds after which there may be room."""
        if self.rate is None or self.rate <= 0.0:
            return 20_000
        return round(min(max((self.flying - self.limit) / self.rate * 1e6, 5_000.0), 20_000.0))

    def narrow(self, at: int) -> bool:
        """Whether the line's queue was filled of late."""
        return self.full_at is not None and at - self.full_at < FORGET

    def slowing(self, at: int) -> bool:
        """Whether the line turned out slower than thought just now: more than should waits in its queue."""
        return self._slowed_at is not None and at - self._slowed_at < SLOWING
