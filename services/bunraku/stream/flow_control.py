"""Flow control of one viewer's link: what may be written now, and how overlays and blocks share the link.

Most links are unconstrained, and a system call for each overlay would cost more than the write itself. A link that had
capacity in many consecutive checks is therefore written to without a check, and reassessed now and then.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Protocol

from bunraku.delivery.congestion import INITIAL_WINDOW_BYTES, PROBE_GAIN, CongestionWindow, bytes_on_wire
from bunraku.websocket.link import LinkSample

UNCONSTRAINED_CHECKS = 64
"""Consecutive checks with capacity after which overlays are written without a check."""
HIGH_RTT_US = 20_000
"""A link with a longer round trip may be a constrained one, microseconds."""
MAX_UNTRACKED_BYTES = 16_384
"""Unacknowledged bytes beyond the window's on a low-RTT link: a client that reads in bursts is not constrained."""
MAX_RTT_INCREASE_US = 100_000
"""Allowed increase over the minimum round trip of a link that is not checked: receivers delay acknowledgements by
40 ms."""
BLOCK_CREDIT_SHARE = 0.3
"""Share of a constrained link's throughput that blocks get beside overlays."""
MAX_BLOCK_CREDIT_S = 0.2
"""Time for which that share may accumulate, seconds: several consecutive blocks would delay overlays."""

BULK_QUEUE_US = 200_000
"""Additional send queue allowed for non-live data on a constrained link, in microseconds."""
HIGH_RTT_CHECK_INTERVAL_US = 250_000
"""Interval between reassessments of an unchecked high-RTT link, microseconds."""
LOW_RTT_CHECK_INTERVAL_US = 4_000_000
"""Interval between reassessments of a low-RTT link, microseconds: the system calls cost as much as a block."""


class Link(Protocol):
    """Link whose send queue can be observed; implemented in `bunraku.websocket.link`."""

    def sample(self) -> LinkSample:
        """Return its present measurements; raise OSError once it is closed."""

    def probe(self, size: int, /) -> bytes:
        """Return the bytes to write directly after `size` bytes, so that their arrival can be measured."""

    def receive_probe_echo(self, payload: bytes) -> bool:
        """Process the answer to a probe."""

    def set_corked(self, corked: bool) -> None:
        """Hold written data until packets are full, or release it."""

    def use_loss_based_congestion(self) -> None:
        """Select loss-based congestion control in the kernel, so that it delays no data."""


class LinkState(Enum):
    """Checks that a write needs, by round trip and by recent congestion.

    | state | round trip | overlays | blocks |
    |---|---|---|---|
    | UNLIMITED | low | written without a check | written without a check, no prefetch |
    | LIMITED | low | checked | checked |
    | HIGH_RTT | high | written without a check | checked, with prefetch |
    | HIGH_RTT_LIMITED | high | checked | checked, with prefetch |

    Whether the throughput is known, and whether the queue was full in the last seconds, are measurements of the
    congestion window and no part of the state.
    """

    UNLIMITED = (False, True)
    LIMITED = (False, False)
    HIGH_RTT = (True, True)
    HIGH_RTT_LIMITED = (True, False)

    def __init__(self, is_high_rtt: bool, skips_overlay_check: bool) -> None:
        self.is_high_rtt = is_high_rtt
        self.skips_overlay_check = skips_overlay_check
        # plain attributes: access to an enum's members by name is slow in Python 3.11, and this runs for each message
        self.is_unlimited = skips_overlay_check and not is_high_rtt
        self.check_interval_us = LOW_RTT_CHECK_INTERVAL_US if self.is_unlimited else HIGH_RTT_CHECK_INTERVAL_US

    @classmethod
    def initial(cls, rtt_us: int) -> LinkState:
        """Return the state of a new link with this round trip."""
        return cls.HIGH_RTT_LIMITED if rtt_us > HIGH_RTT_US else cls.UNLIMITED

    def after_congestion(self) -> LinkState:
        """Return the state once the queue or the round trip has grown: every write is checked."""
        return LinkState.HIGH_RTT_LIMITED if self.is_high_rtt else LinkState.LIMITED

    def after_clear_checks(self) -> LinkState:
        """Return the state after `UNCONSTRAINED_CHECKS` consecutive checks with capacity."""
        return LinkState.HIGH_RTT if self.is_high_rtt else LinkState.UNLIMITED

    def after_fast_echo(self) -> LinkState:
        """Return the state once the first probe was answered quickly: the client is near, behind a proxy."""
        return LinkState.UNLIMITED


class PrefetchState(Enum):
    """Progress of the prefetched base layer, before which nothing is upgraded on a high-RTT link."""

    FILLING = "filling"
    SENT = "sent"
    DELIVERED = "delivered"


class FlowControl:
    """Flow control of one viewer's link."""

    __slots__ = (
        "_block_credit",
        "_clock",
        "_consecutive_clear",
        "_credited_at",
        "_link",
        "_prefetch_end",
        "_untracked_bytes",
        "is_corked",
        "state",
        "window",
    )  # fmt: skip

    def __init__(self, link: Link | None, clock: Callable[[], int]) -> None:
        """Start in the state that the link's round trip suggests.

        A link of None cannot be observed and always has capacity. `clock` returns microseconds. Raises OSError if the
        link is already closed.
        """
        sample = LinkSample(0, 0, 0) if link is None else link.sample()
        self._link = link
        self._clock = clock
        self.window = CongestionWindow()
        # bytes written before the window recorded any
        self._untracked_bytes = sample.written_bytes
        # bytes recorded by the window when the prefetch reached far enough
        self._prefetch_end: int | None = None
        self._consecutive_clear = 0
        self._block_credit = 0.0
        self._credited_at = clock()
        self.is_corked = link is not None
        """True while written data is held until the first block."""
        self.state = LinkState.initial(sample.rtt_us)
        if self.state.is_high_rtt and link is not None:
            link.use_loss_based_congestion()

    def uncork(self) -> None:
        """Release the data held since the start, in one packet: the first block was written, or there is none."""
        if self.is_corked and self._link is not None:
            self.is_corked = False
            self._link.set_corked(False)

    def record_write(self, size: int) -> None:
        """Record that `size` bytes were written at once."""
        if self._link is not None and not self.state.is_unlimited:
            self.window.record_write(self._clock(), size)

    def probe(self, size: int, /) -> bytes:
        """Return the bytes to write together with `size` bytes of data; a size of 0 asks for a probe alone."""
        return b"" if self._link is None or (size and self.state.is_unlimited) else self._link.probe(size)

    def on_probe_echo(self, payload: bytes) -> bool:
        """Process the client's answer to a probe. Return False if it answers none."""
        if self._link is None:
            return False
        was_unmeasured = self.is_unmeasured
        answers_probe = self._link.receive_probe_echo(payload)
        if was_unmeasured and 0 < self._link.sample().rtt_us <= HIGH_RTT_US:
            self.state = self.state.after_fast_echo()
        return answers_probe

    def reassess(self) -> None:
        """Update the state; called now and then, not for each overlay."""
        if self._link is None:
            return
        if not self.state.skips_overlay_check:
            if not self.state.is_high_rtt:
                self._count_check(self.has_capacity() and not self.is_constrained)
            return
        has_capacity = self.state.is_unlimited or (self.has_capacity() and not self.is_constrained)
        try:
            sample = self._link.sample()
        except OSError:
            # the link is closed, which the next write reports
            return
        has_backlog = sample.unacked_bytes - self.window.in_flight_bytes > (
            INITIAL_WINDOW_BYTES if self.state.is_high_rtt else MAX_UNTRACKED_BYTES
        )
        if has_backlog or not has_capacity or sample.rtt_us > sample.min_rtt_us + MAX_RTT_INCREASE_US:
            self.state, self._consecutive_clear = self.state.after_congestion(), 0
        if has_backlog:
            # the queue was filled by writes that the window did not record
            self.window = CongestionWindow()
            self._prefetch_end = None if self._prefetch_end is None else 0
            self.window.record_write(self._clock(), sample.unacked_bytes)
            self._untracked_bytes = sample.written_bytes - sample.unacked_bytes

    def can_write_overlay(self) -> bool:
        """Return True if an overlay may be written now; the kernel is asked only where the state requires it."""
        if self.state.skips_overlay_check:
            return True
        is_clear = not self.is_constrained and self.has_capacity()
        self._count_check(is_clear)
        return is_clear

    def _count_check(self, is_clear: bool) -> None:
        self._consecutive_clear = self._consecutive_clear + 1 if is_clear else 0
        if self._consecutive_clear >= UNCONSTRAINED_CHECKS:
            self.state = self.state.after_clear_checks()

    def has_capacity(self, extra_queue_us: int = 0) -> bool:
        """Return True if data may be written now; `extra_queue_us` as in `CongestionWindow.has_capacity`."""
        if self._link is None:
            return True
        now = self._clock()
        if self.window.in_flight_bytes or self.state.skips_overlay_check:
            try:
                sample = self._link.sample()
            except OSError:
                # the link is closed, which the next write reports
                return True
            # overlays that were written without a check
            self.window.record_untracked_write(
                max(sample.written_bytes - self._untracked_bytes - self.window.written, 0)
            )
            self.window.record_ack(now, sample.unacked_bytes, sample.min_rtt_us)
        return self.window.has_capacity(now, extra_queue_us)

    @property
    def is_constrained(self) -> bool:
        """True if the link's queue was full within the last seconds."""
        return self._link is not None and self.window.is_constrained(self._clock())

    @property
    def is_slowing(self) -> bool:
        """True if the link has just become slower than estimated: data that can wait would add to its queue."""
        return self._link is not None and self.window.is_slowing(self._clock())

    @property
    def is_unmeasured(self) -> bool:
        """True if the link may be constrained, and nothing was acknowledged yet."""
        return self.state.is_high_rtt and self.window.throughput is None

    @property
    def throughput(self) -> float | None:
        """Throughput of a link that may be constrained, bytes/s; None for other links, and while it is unknown."""
        throughput = self.window.throughput
        if throughput is None or not (self.state.is_high_rtt or self.is_constrained):
            return None
        # a link that was never full has more throughput than was observed
        return throughput if self.window.queue_full_at is not None else PROBE_GAIN * throughput

    @property
    def is_awaiting_ack(self) -> bool:
        """True if data is in flight whose acknowledgement decides what may be sent next."""
        return self.window.in_flight_bytes > 0 and (self.is_unmeasured or self.prefetch_state is PrefetchState.SENT)

    @property
    def prefetch_state(self) -> PrefetchState:
        """Progress of the prefetched base layer; always DELIVERED on a link that cannot be observed."""
        if self._link is None:
            return PrefetchState.DELIVERED
        if self._prefetch_end is None:
            return PrefetchState.FILLING
        return PrefetchState.DELIVERED if self.window.is_acked(self._prefetch_end) else PrefetchState.SENT

    def mark_prefetch_sent(self) -> None:
        """Record that the data written so far includes a base layer that reaches far enough."""
        if self._prefetch_end is None:
            self._prefetch_end = self.window.written

    def charge_block(self, size: int) -> None:
        """Charge a block of `size` bytes to the credit of blocks."""
        self._block_credit -= bytes_on_wire(size)

    def may_send_block(self) -> bool:
        """Return True if a block that can wait may take capacity from overlays.

        Blocks have a share of a constrained link's throughput, but none while too much data is in flight.
        """
        now, throughput = self._clock(), self.window.throughput or 0.0
        self._block_credit += BLOCK_CREDIT_SHARE * throughput * (now - self._credited_at) * 1e-6
        self._block_credit = min(self._block_credit, BLOCK_CREDIT_SHARE * throughput * MAX_BLOCK_CREDIT_S)
        self._credited_at = now
        return self._block_credit > 0 and not self.is_slowing
