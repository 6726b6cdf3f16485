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

HEADER_BYTES = 54
"""Bytes of heads that a message costs on the line: IPv4, TCP with time stamps, and a WebSocket frame's."""
MAX_SEGMENT_BYTES = 1_400
"""Of a longer message each such part is a packet."""
DELAYED_ACK_US = 40_000
"""A receiver waits so long before it acknowledges, microseconds."""
ACK_LATENESS_MARGIN_US = 20_000
"""So much later than it should at the latest an acknowledgement may come, microseconds."""
MAX_ACK_DELAY_US = 60_000
"""No acknowledgement waits longer at a receiver than this, microseconds."""
DRAIN_TIME_FACTOR = 1.03
"""The line is taken to be so much slower than it seems: what is thought of its queue is then corrected at once."""
TARGET_QUEUE_BYTES = 220
"""Bytes that are to wait in the line's queue: a message or two,"""
MAX_TARGET_QUEUE_US = 40_000
"""but no more than leave in this time, microseconds,"""
MIN_TARGET_QUEUE_BYTES = 75.0
"""or than this."""
INITIAL_WINDOW_BYTES = 1_600
"""The window before anything is known: a first block, its Description, and some more."""
SMALL_MESSAGE_BYTES = 250
"""Bytes of a message that is not large."""
MIN_WINDOW_GROWTH_BYTES = 60.0
"""Bytes that a window grows by at least, where it is too small."""
MAX_POLL_INTERVAL_US = 40_000
"""A round trip counts only if its end was looked out for as often as this."""
ROUND_TRIP_BYTES = 190
"""Bytes that go there and back for a message and its acknowledgement."""
MIN_THROUGHPUT_SAMPLE_US = 20_000
"""What was acknowledged within less time than this says nothing of the line's rate, microseconds."""
THROUGHPUT_WEIGHT = 0.3
"""Of the newest in the mean of the line's rate."""
SLOWDOWN_RATIO = 0.6
"""A line that seems to carry less than this share of what it did has become slower,"""
SLOWDOWN_WEIGHT = 0.8
"""and the newest weighs more."""
SLOWDOWN_PERIOD_US = 400_000
"""So long after it was last later than thought a line's queue may be too full, microseconds."""
THROUGHPUT_KNOWN_US = 2_000_000
"""So long after its queue was seen filled what a line carries is known."""
PROBE_GAIN = 2.0
"""A line that was not full is taken to carry so much more."""
CONSTRAINED_PERIOD_US = 10_000_000
"""So long after its queue was last seen filled a line counts as narrow."""


def bytes_on_wire(size: int) -> int:
    """Bytes that a message of `size` bytes takes on the line."""
    return size + HEADER_BYTES * (1 + max(size - 1, 0) // MAX_SEGMENT_BYTES)


class _InFlightMessage(NamedTuple):
    """A message on its way: its end in bytes written and in bytes of the line, when it was written, the bytes on their
    way then (of none more than a message has), how much larger it is than a message; what was acknowledged by then, and
    since when nothing else was; and when the line is through with it, but for `Window._shift`."""

    end: int
    wire_end: int
    written_at: int
    in_flight_bytes: int
    excess_bytes: int
    acked_bytes: int
    interval_start: int
    drained_at: float


class CongestionWindow:
    """The window of one line: told what was written and how much of it was acknowledged."""

    def __init__(self) -> None:
        self.limit_bytes = float(INITIAL_WINDOW_BYTES)
        """Bytes that may be on their way."""
        self.min_rtt_us: int | None = None
        """The least time from writing to acknowledgement so far."""
        self.throughput: float | None = None
        """Bytes a second that the line carries, or carried at least while it was never full."""
        self._max_throughput = 0.0
        self.queue_full_at: int | None = None
        """When the line's queue was last seen to be filled."""
        self._slowdown_at: int | None = None
        self._written = 0
        self._wire_written = 0
        self._wire_acked = 0
        self._in_flight: deque[_InFlightMessage] = deque()
        self._acked_at = 0
        # beyond what a message has, of what is on its way; and when the line is through with it
        self._excess_in_flight = 0
        self._excess_drained_at = 0.0
        # when the line is through with all that was written, and by how much that was corrected so far
        self._drained_at = 0.0
        self._drain_correction = 0.0
        self._polled_at = 0
        self._is_window_limited = False
        # the present round trip: since when, and the shortest in it
        self._round_started_at = 0
        self._round_min_rtt: int | None = None

    @property
    def in_flight_bytes(self) -> int:
        """Bytes of the line that are not acknowledged yet."""
        return self._wire_written - self._wire_acked

    @property
    def target_delay_us(self) -> float:
        """How much later than they could acknowledgements are to come, microseconds."""
        return DELAYED_ACK_US + self.target_queue_us

    @property
    def target_queue_us(self) -> float:
        """For how long what waits in the line's queue is to be enough, microseconds."""
        if not self.throughput:
            return 0.0
        return (
            min(TARGET_QUEUE_BYTES, max(self.throughput * MAX_TARGET_QUEUE_US * 1e-6, MIN_TARGET_QUEUE_BYTES))
            / self.throughput
            * 1e6
        )

    @property
    def expected_min_rtt_us(self) -> float:
        """The least time from writing to acknowledgement at the present rate, microseconds: a line that has become
        slower takes longer for the same bytes."""
        assert self.min_rtt_us is not None
        if not self.throughput or self.throughput >= self._max_throughput:
            return self.min_rtt_us
        return self.min_rtt_us + ROUND_TRIP_BYTES * (1.0 / self.throughput - 1.0 / self._max_throughput) * 1e6

    def record_write(self, at: int, size: int) -> None:
        """`size` bytes were written at once at `at`."""
        self._written += size
        large = max(bytes_on_wire(size) - SMALL_MESSAGE_BYTES, 0)
        self._wire_written += bytes_on_wire(size)
        self._excess_in_flight += large
        if large and self.throughput:
            # a line that was never full carries more than it was seen to
            rate = (
                self.throughput
                if self.queue_full_at is not None and at - self.queue_full_at < THROUGHPUT_KNOWN_US
                else PROBE_GAIN * self.throughput
            )
            self._excess_drained_at = max(self._excess_drained_at, at) + bytes_on_wire(size) / rate * 1e6
        since = max(self._acked_at, self._in_flight[0].written_at) if self._in_flight else at
        if self.throughput:
            self._drained_at = (
                max(self._drained_at, at) + bytes_on_wire(size) / self.throughput * DRAIN_TIME_FACTOR * 1e6
            )
        self._in_flight.append(
            _InFlightMessage(
                self._written, self._wire_written, at, self.in_flight_bytes - self._excess_in_flight, large,
                self._wire_acked, since, self._drained_at - self._drain_correction,
            )
        )  # fmt: skip

    @property
    def written(self) -> int:
        """Bytes that were written."""
        return self._written

    def is_acked(self, written: int) -> bool:
        """Whether the first `written` bytes are acknowledged."""
        return not self._in_flight or self._in_flight[0].end > written

    def record_untracked_write(self, size: int) -> None:
        """`size` bytes were written besides; they are not counted among those on their way."""
        self._written += size

    def record_ack(self, at: int, unacked_bytes: int, min_rtt_us: int | None = None) -> None:
        """At `at`, of all that was written the last `waiting` bytes are not acknowledged yet; `least` is the shortest
        round trip that the system knows of, if it tells."""
        done = self._written - max(unacked_bytes, 0)
        looked, self._polled_at = self._polled_at, at
        newest: _InFlightMessage | None = None
        while self._in_flight and self._in_flight[0].end <= done:
            newest = self._in_flight.popleft()
            self._wire_acked = newest.wire_end
            self._excess_in_flight -= newest.excess_bytes
        if newest is None:
            return
        self._acked_at = at
        if not self._excess_in_flight:
            self._excess_drained_at = at
        took = max(at - newest.written_at, 1)
        self.min_rtt_us = min(time for time in (self.min_rtt_us, min_rtt_us, took) if time)
        if self.throughput:
            self._correct_drain_time(
                at,
                at - (self.min_rtt_us - HEADER_BYTES / self.throughput * 1e6),
                newest.drained_at + self._drain_correction,
            )
        if at - max(looked, newest.written_at) <= MAX_POLL_INTERVAL_US:
            self._update_estimates(at, took, newest)

    def _correct_drain_time(self, at: int, observed: float, estimated: float) -> None:
        """At `at` it is known that the line was through with a message at `left` at the latest, and no more than
        `RECEIVER` before."""
        if estimated < observed - MAX_ACK_DELAY_US:
            self._slowdown_at = at
        if not observed - MAX_ACK_DELAY_US <= estimated <= observed:
            self._drain_correction += observed - estimated
            self._drained_at += observed - estimated

    def _update_estimates(self, at: int, rtt: int, newest: _InFlightMessage) -> None:
        """What was last acknowledged took so long."""
        rate = (newest.wire_end - newest.acked_bytes) * 1e6 / max(at - newest.interval_start, 1)
        late = rtt - self.expected_min_rtt_us
        if self.throughput is None:
            self.throughput = rate
        elif late > self.target_delay_us:
            self.throughput += (THROUGHPUT_WEIGHT if rate > SLOWDOWN_RATIO * self.throughput else SLOWDOWN_WEIGHT) * (
                rate - self.throughput
            )
            self._max_throughput = max(self._max_throughput, self.throughput)
        elif at - newest.interval_start >= MIN_THROUGHPUT_SAMPLE_US:
            self.throughput = max(self.throughput, rate)
        if late > self.target_delay_us:
            self.queue_full_at = at
        if newest.in_flight_bytes <= self.limit_bytes + SMALL_MESSAGE_BYTES and not newest.excess_bytes:
            # else it was behind something larger than the window
            self._round_min_rtt = min(self._round_min_rtt or rtt, rtt)
            if late > 2 * self.target_delay_us and not self._excess_in_flight:
                # the line has become slower
                self.limit_bytes = min(
                    self.limit_bytes, self.throughput * (self.expected_min_rtt_us + self.target_delay_us) * 1e-6
                )
        written = newest.written_at
        if written < self._round_started_at:
            return
        # a round trip has passed: this was written after the last turn
        if self._round_min_rtt is not None:
            queued = self._round_min_rtt - self.expected_min_rtt_us
            if queued > self.target_delay_us:
                self.limit_bytes *= (self.expected_min_rtt_us + self.target_delay_us) / self._round_min_rtt
            elif self._is_window_limited:
                self.limit_bytes += max(
                    self.limit_bytes * 0.5 * (1.0 - queued / self.target_delay_us), MIN_WINDOW_GROWTH_BYTES
                )
        self.limit_bytes = max(self.limit_bytes, float(SMALL_MESSAGE_BYTES))
        self._round_started_at, self._round_min_rtt, self._is_window_limited = at, None, False

    def has_capacity(self, at: int, extra_queue_us: int = 0) -> bool:
        """Whether something may be written at `at`: always when nothing is on its way. `ahead` is for how long more may
        wait in the line's queue, microseconds, so that it never runs dry; once what the line carries is known."""
        if not self._in_flight:
            return True
        extra_queue_us = extra_queue_us if self.throughput else 0
        if self.throughput and self.min_rtt_us is not None and self.is_constrained(at):
            # when its acknowledgement is to come at the latest
            latest = self._in_flight[0].drained_at + self._drain_correction + self.min_rtt_us + MAX_ACK_DELAY_US
            return (
                at <= latest + ACK_LATENESS_MARGIN_US and self._drained_at - at <= self.target_queue_us + extra_queue_us
            )
        # the line is through with what is large at a time that is known, once its rate is
        if (
            self.in_flight_bytes - (self._excess_in_flight if self.throughput else 0)
            >= self.limit_bytes + (self.throughput or 0.0) * extra_queue_us * 1e-6
        ):
            self._is_window_limited = True
            return False
        if at < self._excess_drained_at - extra_queue_us:
            return False
        # nothing came back for long: the line has become slower, or stands
        return (
            self.min_rtt_us is None
            or at - self._in_flight[0].written_at
            <= self.expected_min_rtt_us + 2 * self.target_delay_us + extra_queue_us
        )

    def time_to_drain(self, at: int) -> int:
        """Microseconds until the line will be through with all that is on its way, as far as is known."""
        if not self._in_flight or not self.throughput or self.min_rtt_us is None:
            return 0
        # what was acknowledged last had left by then, and the line went on with what is first of the rest
        left = self._acked_at - self.min_rtt_us + HEADER_BYTES / self.throughput * 1e6
        return max(
            round(max(left, self._in_flight[0].written_at) + self.in_flight_bytes / self.throughput * 1e6) - at, 0
        )

    def retry_delay(self) -> int:
        """Microseconds after which there may be room."""
        if self.throughput is None or self.throughput <= 0.0:
            return 20_000
        return round(min(max((self.in_flight_bytes - self.limit_bytes) / self.throughput * 1e6, 5_000.0), 20_000.0))

    def is_constrained(self, at: int) -> bool:
        """Whether the line's queue was filled of late."""
        return self.queue_full_at is not None and at - self.queue_full_at < CONSTRAINED_PERIOD_US

    def is_slowing(self, at: int) -> bool:
        """Whether the line turned out slower than thought just now: more than should waits in its queue."""
        return self._slowdown_at is not None and at - self._slowdown_at < SLOWDOWN_PERIOD_US
