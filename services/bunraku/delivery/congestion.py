"""Congestion window of a sender that keeps the queue of a constrained link short.

A constrained link queues what it cannot send yet, and TCP fills that queue, so that the newest data waits behind old
data. This window of unacknowledged bytes keeps about `TARGET_QUEUE_BYTES` in the queue: once per round trip it is
corrected by the surplus or deficit (as in FAST TCP, Wei, Jin, Low and Hegde 2006). The minimum round-trip time in that
interval counts, since receivers delay acknowledgements. The throughput is estimated from the bytes acknowledged between
two acknowledgements (the delivery rate of BBR, Cardwell et al. 2016, over the bytes on the wire).

Sizes are bytes on the wire: every message is a packet with its own headers. Times are microseconds of any clock that
does not run backwards.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

HEADER_BYTES = 54
"""Header overhead of a message: IPv4, TCP with time stamps, and a WebSocket frame."""
MAX_SEGMENT_BYTES = 1_400
"""Payload of one packet; a longer message has several."""
DELAYED_ACK_US = 40_000
"""Delay of a receiver's acknowledgement, microseconds."""
ACK_LATENESS_MARGIN_US = 20_000
"""Tolerance for an acknowledgement after its latest expected time, microseconds."""
MAX_ACK_DELAY_US = 60_000
"""Upper bound of a receiver's acknowledgement delay, microseconds."""
DRAIN_TIME_FACTOR = 1.03
"""Factor on the estimated transmission time: an estimate that is slightly too long is corrected at once."""
TARGET_QUEUE_BYTES = 220
"""Target length of the link's queue: one or two messages."""
MAX_TARGET_QUEUE_US = 40_000
"""Upper bound of that target, as transmission time in microseconds."""
MIN_TARGET_QUEUE_BYTES = 75.0
"""Lower bound of that target."""
INITIAL_WINDOW_BYTES = 1_600
"""Window before any measurement: a first block, its Description, and some more."""
SMALL_MESSAGE_BYTES = 250
"""Size up to which a message is not counted as large."""
MIN_WINDOW_GROWTH_BYTES = 60.0
"""Minimum growth of a window that is too small."""
MAX_POLL_INTERVAL_US = 40_000
"""A round-trip time is used only if acknowledgements were polled at least this often, microseconds."""
ROUND_TRIP_BYTES = 190
"""Bytes on the wire of a message and its acknowledgement, both directions."""
MIN_THROUGHPUT_SAMPLE_US = 20_000
"""Minimum interval of a throughput measurement, microseconds."""
THROUGHPUT_WEIGHT = 0.3
"""Weight of the newest measurement in the mean throughput."""
SLOWDOWN_RATIO = 0.6
"""A measurement below this share of the mean shows that the link has become slower."""
SLOWDOWN_WEIGHT = 0.8
"""Weight of such a measurement."""
SLOWDOWN_PERIOD_US = 400_000
"""Time after a late acknowledgement for which the queue may be too long, microseconds."""
THROUGHPUT_KNOWN_US = 2_000_000
"""Time after a full queue for which the throughput is taken as known, microseconds."""
PROBE_GAIN = 2.0
"""Factor on the observed throughput of a link that was not full."""
CONSTRAINED_PERIOD_US = 10_000_000
"""Time after a full queue for which a link counts as constrained, microseconds."""


def bytes_on_wire(size: int) -> int:
    """Return the bytes on the wire of a message of `size` bytes."""
    return size + HEADER_BYTES * (1 + max(size - 1, 0) // MAX_SEGMENT_BYTES)


class _InFlightMessage(NamedTuple):
    """Message that is not acknowledged yet."""

    end: int
    """Bytes written up to its end, without headers."""
    wire_end: int
    """Bytes on the wire up to its end."""
    written_at: int
    in_flight_bytes: int
    """Bytes in flight when it was written, without the excess of large messages."""
    excess_bytes: int
    """Bytes by which it exceeds `SMALL_MESSAGE_BYTES`."""
    acked_bytes: int
    """Bytes on the wire that were acknowledged when it was written."""
    interval_start: int
    """Start of the interval over which its delivery rate is measured."""
    drained_at: float
    """Estimated time at which the link has sent it, before `CongestionWindow._drain_correction`."""


class CongestionWindow:
    """Congestion window of one link, from the times of writes and acknowledgements."""

    def __init__(self) -> None:
        self.limit_bytes = float(INITIAL_WINDOW_BYTES)
        """Bytes that may be in flight."""
        self.min_rtt_us: int | None = None
        """Minimum time from write to acknowledgement."""
        self.throughput: float | None = None
        """Throughput of the link, bytes/s; a lower bound while its queue was never full."""
        self._max_throughput = 0.0
        self.queue_full_at: int | None = None
        """Time at which the link's queue was last observed to be full."""
        self._slowdown_at: int | None = None
        self._written = 0
        self._wire_written = 0
        self._wire_acked = 0
        self._in_flight: deque[_InFlightMessage] = deque()
        self._acked_at = 0
        # excess bytes of large messages in flight, and when the link has sent them
        self._excess_in_flight = 0
        self._excess_drained_at = 0.0
        # when the link has sent all that was written, and the sum of corrections of that estimate
        self._drained_at = 0.0
        self._drain_correction = 0.0
        self._polled_at = 0
        self._is_window_limited = False
        # start of the present round trip, and the minimum round-trip time in it
        self._round_started_at = 0
        self._round_min_rtt: int | None = None

    @property
    def in_flight_bytes(self) -> int:
        """Bytes on the wire that are not acknowledged yet."""
        return self._wire_written - self._wire_acked

    @property
    def target_delay_us(self) -> float:
        """Target delay of acknowledgements over the minimum, microseconds."""
        return DELAYED_ACK_US + self.target_queue_us

    @property
    def target_queue_us(self) -> float:
        """Target length of the link's queue, as transmission time in microseconds."""
        if not self.throughput:
            return 0.0
        return (
            min(TARGET_QUEUE_BYTES, max(self.throughput * MAX_TARGET_QUEUE_US * 1e-6, MIN_TARGET_QUEUE_BYTES))
            / self.throughput
            * 1e6
        )

    @property
    def expected_min_rtt_us(self) -> float:
        """Minimum time from write to acknowledgement at the present throughput, microseconds.

        A link that has become slower takes longer for the same bytes.
        """
        assert self.min_rtt_us is not None
        if not self.throughput or self.throughput >= self._max_throughput:
            return self.min_rtt_us
        return self.min_rtt_us + ROUND_TRIP_BYTES * (1.0 / self.throughput - 1.0 / self._max_throughput) * 1e6

    def record_write(self, at: int, size: int) -> None:
        """Record that `size` bytes were written at once at `at`."""
        self._written += size
        excess = max(bytes_on_wire(size) - SMALL_MESSAGE_BYTES, 0)
        self._wire_written += bytes_on_wire(size)
        self._excess_in_flight += excess
        if excess and self.throughput:
            # a link that was never full has more throughput than was observed
            throughput = (
                self.throughput
                if self.queue_full_at is not None and at - self.queue_full_at < THROUGHPUT_KNOWN_US
                else PROBE_GAIN * self.throughput
            )
            self._excess_drained_at = max(self._excess_drained_at, at) + bytes_on_wire(size) / throughput * 1e6
        interval_start = max(self._acked_at, self._in_flight[0].written_at) if self._in_flight else at
        if self.throughput:
            self._drained_at = (
                max(self._drained_at, at) + bytes_on_wire(size) / self.throughput * DRAIN_TIME_FACTOR * 1e6
            )
        self._in_flight.append(
            _InFlightMessage(
                self._written, self._wire_written, at, self.in_flight_bytes - self._excess_in_flight, excess,
                self._wire_acked, interval_start, self._drained_at - self._drain_correction,
            )
        )  # fmt: skip

    @property
    def written(self) -> int:
        """Bytes that were written, without headers."""
        return self._written

    def is_acked(self, written: int) -> bool:
        """Return True if the first `written` bytes are acknowledged."""
        return not self._in_flight or self._in_flight[0].end > written

    def record_untracked_write(self, size: int) -> None:
        """Record `size` bytes that were written without `record_write`; they do not count as in flight."""
        self._written += size

    def record_ack(self, at: int, unacked_bytes: int, min_rtt_us: int | None = None) -> None:
        """Record that at `at` all but the last `unacked_bytes` written bytes are acknowledged.

        `min_rtt_us` is the minimum round-trip time measured by the kernel, if it is known.
        """
        acked = self._written - max(unacked_bytes, 0)
        polled_at, self._polled_at = self._polled_at, at
        newest: _InFlightMessage | None = None
        while self._in_flight and self._in_flight[0].end <= acked:
            newest = self._in_flight.popleft()
            self._wire_acked = newest.wire_end
            self._excess_in_flight -= newest.excess_bytes
        if newest is None:
            return
        self._acked_at = at
        if not self._excess_in_flight:
            self._excess_drained_at = at
        rtt = max(at - newest.written_at, 1)
        self.min_rtt_us = min(time for time in (self.min_rtt_us, min_rtt_us, rtt) if time)
        if self.throughput:
            self._correct_drain_time(
                at,
                at - (self.min_rtt_us - HEADER_BYTES / self.throughput * 1e6),
                newest.drained_at + self._drain_correction,
            )
        if at - max(polled_at, newest.written_at) <= MAX_POLL_INTERVAL_US:
            self._update_estimates(at, rtt, newest)

    def _correct_drain_time(self, at: int, observed: float, estimated: float) -> None:
        """Correct the estimate of when the link has sent a message.

        The acknowledgement at `at` shows that it was sent at `observed` at the latest, and at most `MAX_ACK_DELAY_US`
        earlier.
        """
        if estimated < observed - MAX_ACK_DELAY_US:
            self._slowdown_at = at
        if not observed - MAX_ACK_DELAY_US <= estimated <= observed:
            self._drain_correction += observed - estimated
            self._drained_at += observed - estimated

    def _update_estimates(self, at: int, rtt: int, newest: _InFlightMessage) -> None:
        """Update throughput and window from the round-trip time of the newest acknowledged message."""
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
            # otherwise it waited behind data larger than the window
            self._round_min_rtt = min(self._round_min_rtt or rtt, rtt)
            if late > 2 * self.target_delay_us and not self._excess_in_flight:
                # the link has become slower
                self.limit_bytes = min(
                    self.limit_bytes, self.throughput * (self.expected_min_rtt_us + self.target_delay_us) * 1e-6
                )
        written = newest.written_at
        if written < self._round_started_at:
            return
        # a round trip has passed: the message was written after the last update of the window
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
        """Return True if data may be written at `at`; always if nothing is in flight.

        `extra_queue_us` is the additional queue that is allowed once the throughput is known, microseconds: it keeps
        the link from running idle.
        """
        if not self._in_flight:
            return True
        extra_queue_us = extra_queue_us if self.throughput else 0
        if self.throughput and self.min_rtt_us is not None and self.is_constrained(at):
            # latest time of the oldest acknowledgement
            latest = self._in_flight[0].drained_at + self._drain_correction + self.min_rtt_us + MAX_ACK_DELAY_US
            return (
                at <= latest + ACK_LATENESS_MARGIN_US and self._drained_at - at <= self.target_queue_us + extra_queue_us
            )
        # the time at which large messages are sent is known once the throughput is
        if (
            self.in_flight_bytes - (self._excess_in_flight if self.throughput else 0)
            >= self.limit_bytes + (self.throughput or 0.0) * extra_queue_us * 1e-6
        ):
            self._is_window_limited = True
            return False
        if at < self._excess_drained_at - extra_queue_us:
            return False
        # without an acknowledgement for long, the link has become slower or stalls
        return (
            self.min_rtt_us is None
            or at - self._in_flight[0].written_at
            <= self.expected_min_rtt_us + 2 * self.target_delay_us + extra_queue_us
        )

    def time_to_drain(self, at: int) -> int:
        """Return the estimated time until the link has sent everything in flight, microseconds."""
        if not self._in_flight or not self.throughput or self.min_rtt_us is None:
            return 0
        # the last acknowledged message was sent by then, and the next one followed
        sent_at = self._acked_at - self.min_rtt_us + HEADER_BYTES / self.throughput * 1e6
        return max(
            round(max(sent_at, self._in_flight[0].written_at) + self.in_flight_bytes / self.throughput * 1e6) - at, 0
        )

    def retry_delay(self) -> int:
        """Return the time after which there may be capacity, microseconds."""
        if self.throughput is None or self.throughput <= 0.0:
            return 20_000
        return round(min(max((self.in_flight_bytes - self.limit_bytes) / self.throughput * 1e6, 5_000.0), 20_000.0))

    def is_constrained(self, at: int) -> bool:
        """Return True if the link's queue was full within `CONSTRAINED_PERIOD_US`."""
        return self.queue_full_at is not None and at - self.queue_full_at < CONSTRAINED_PERIOD_US

    def is_slowing(self, at: int) -> bool:
        """Return True if the link has just become slower than estimated, so that its queue is too long."""
        return self._slowdown_at is not None and at - self._slowdown_at < SLOWDOWN_PERIOD_US
