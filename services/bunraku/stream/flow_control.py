"""When there is room on one viewer's line, and whose turn it is where the live overlay and blocks share it.

Most lines are quick, and asking the system about each of them for each overlay would cost more than writing it. So a
line that had room many times in a row counts as quick, is written to unasked, and is looked at now and then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bunraku.delivery.congestion import INITIAL_WINDOW_BYTES, PROBE_GAIN, CongestionWindow, bytes_on_wire
from bunraku.websocket.link import LinkSample

UNCONSTRAINED_CHECKS = 64
"""So many times there was room at once before a line counts as quick."""
HIGH_RTT_US = 20_000
"""Round trips that take longer, microseconds, may be those of a narrow line."""
MAX_UNTRACKED_BYTES = 16_384
"""So much may wait on a line that is near: who reads in gulps is not narrow."""
MAX_RTT_INCREASE_US = 100_000
"""So much longer than the least the round trips of a quick line may take: receivers may wait 40 ms to acknowledge."""
BLOCK_CREDIT_SHARE = 0.3
"""The share of a narrow line that blocks get beside overlays,"""
MAX_BLOCK_CREDIT_S = 0.2
"""and for how many seconds they can save it up: several blocks in a row would keep overlays waiting."""


class Link(Protocol):
    """A line that can be read, as those of `bunraku.websocket.link`."""

    def sample(self) -> LinkSample:
        """How it stands now; raises OSError once it is closed."""

    def probe(self, size: int, /) -> bytes:
        """What is to be written right behind `size` bytes so that it can be read."""

    def receive_probe_echo(self, payload: bytes) -> None:
        """What was asked has come back."""

    def set_corked(self, corked: bool) -> None:
        """Keep what is written together in packets as full as can be, or let it go."""

    def use_loss_based_congestion(self) -> None:
        """Have the system hold back no more than it must."""


class FlowControl:
    """What one viewer's line can take now. `steady` says that it counts as quick: overlays are written to it unasked,
    and need not be told of."""

    __slots__ = (
        "_block_credit",
        "_clock",
        "_consecutive_clear",
        "_credited_at",
        "_link",
        "_prefetch_end",
        "_untracked_bytes",
        "is_corked",
        "is_high_rtt",
        "is_unconstrained",
        "window",
    )  # fmt: skip

    def __init__(self, link: Link | None, clock: Callable[[], int]) -> None:
        """`line` None: nothing is known of it, and there is always room; `now` tells microseconds. Raises OSError for a
        line that is closed already."""
        reading = LinkSample(0, 0, 0) if link is None else link.sample()
        self._link = link
        self._clock = clock
        self.window = CongestionWindow()
        # what had been written before the window was told of anything
        self._untracked_bytes = reading.written_bytes
        # of what the window was told, how much was written when the net reached far enough
        self._prefetch_end: int | None = None
        self._consecutive_clear = 0
        self._block_credit = 0.0
        self._credited_at = clock()
        self.is_corked = link is not None
        """Whether what is written is held until the first block is."""
        self.is_high_rtt = reading.rtt_us > HIGH_RTT_US
        """Whether answers take their time: the line may be a narrow one, or one that stands now and then."""
        self.is_unconstrained = not self.is_high_rtt
        if self.is_high_rtt and link is not None:
            link.use_loss_based_congestion()

    @property
    def is_unlimited(self) -> bool:
        """Whether blocks, too, are written unasked, and none is kept as a net."""
        return self.is_unconstrained and not self.is_high_rtt

    def uncork(self) -> None:
        """The first block was written, or there is none: what was held so far goes, in one packet."""
        if self.is_corked and self._link is not None:
            self.is_corked = False
            self._link.set_corked(False)

    def record_write(self, size: int) -> None:
        """Bytes were written, in one go."""
        if self._link is not None and not self.is_unlimited:
            self.window.record_write(self._clock(), size)

    def probe(self, size: int, /) -> bytes:
        """What is to be written right behind `size` bytes, in one go with them; of none before a look."""
        return b"" if self._link is None or (self.is_unlimited and size) else self._link.probe(size)

    def on_probe_echo(self, payload: bytes) -> None:
        """The other end has answered a Ping that asked."""
        if self._link is None:
            return
        unknown = self.is_unmeasured
        self._link.receive_probe_echo(payload)
        if unknown and 0 < self._link.sample().rtt_us <= HIGH_RTT_US:
            # it is near, as far as the proxy is
            self.is_high_rtt, self.is_unconstrained = False, True

    def reassess(self) -> None:
        """Now and then, and not for each overlay: whether the line still counts as quick, or does again."""
        if self._link is None:
            return
        if not self.is_unconstrained:
            if not self.is_high_rtt:
                self._count_check(self.has_capacity() and not self.is_constrained)
            return
        room = self.is_unlimited or (self.has_capacity() and not self.is_constrained)
        try:
            reading = self._link.sample()
        except OSError:
            # it is closed: whoever writes to it is told
            return
        untold = reading.unacked_bytes - self.window.in_flight_bytes > (
            INITIAL_WINDOW_BYTES if self.is_high_rtt else MAX_UNTRACKED_BYTES
        )
        if untold or not room or reading.rtt_us > reading.min_rtt_us + MAX_RTT_INCREASE_US:
            self.is_unconstrained, self._consecutive_clear = False, 0
        if untold:
            # it was filled by what the window knows nothing of
            self.window = CongestionWindow()
            self._prefetch_end = None if self._prefetch_end is None else 0
            self.window.record_write(self._clock(), reading.unacked_bytes)
            self._untracked_bytes = reading.written_bytes - reading.unacked_bytes

    def can_write_overlay(self) -> bool:
        """Whether an overlay may be written whole and at once; the system is asked unless the line is `steady`."""
        if self.is_unconstrained:
            return True
        clean = not self.is_constrained and self.has_capacity()
        self._count_check(clean)
        return clean

    def _count_check(self, clear: bool) -> None:
        self._consecutive_clear = self._consecutive_clear + 1 if clear else 0
        self.is_unconstrained = self._consecutive_clear >= UNCONSTRAINED_CHECKS

    def has_capacity(self, extra_queue_us: int = 0) -> bool:
        """Whether something may be written now; `ahead` as of `Window.room`."""
        if self._link is None:
            return True
        now = self._clock()
        if self.window.in_flight_bytes or self.is_unconstrained:
            try:
                reading = self._link.sample()
            except OSError:
                # it is closed: whoever writes to it is told
                return True
            # overlays that were written unasked
            self.window.record_untracked_write(
                max(reading.written_bytes - self._untracked_bytes - self.window.written, 0)
            )
            self.window.record_ack(now, reading.unacked_bytes, reading.min_rtt_us)
        return self.window.has_capacity(now, extra_queue_us)

    @property
    def is_constrained(self) -> bool:
        """Whether the line was full of late."""
        return self._link is not None and self.window.is_constrained(self._clock())

    @property
    def is_slowing(self) -> bool:
        """Whether the line turned out slower than thought just now: what can wait would make it worse."""
        return self._link is not None and self.window.is_slowing(self._clock())

    @property
    def throughput(self) -> float | None:
        """Bytes a second of a line that may be a narrow one, None where it is not or nothing is known."""
        rate = self.window.throughput
        if rate is None or not (self.is_high_rtt or self.is_constrained):
            return None
        # as long as it was never full it carries more than it was seen to
        return rate if self.window.queue_full_at is not None else PROBE_GAIN * rate

    @property
    def is_unmeasured(self) -> bool:
        """Whether the line may be narrow: nothing was acknowledged yet."""
        return self.is_high_rtt and self.window.throughput is None

    @property
    def is_awaiting_ack(self) -> bool:
        """Whether something is on its way that will tell of the line."""
        return self.window.in_flight_bytes > 0 and (
            self.is_unmeasured or (self._prefetch_end is not None and not self.is_prefetch_delivered)
        )

    def mark_prefetch_sent(self) -> None:
        """What was written by now is a net that reaches far enough."""
        if self._prefetch_end is None:
            self._prefetch_end = self.window.written

    @property
    def is_prefetch_delivered(self) -> bool:
        """Whether such a net is at the other end."""
        return self._link is None or (self._prefetch_end is not None and self.window.is_acked(self._prefetch_end))

    def charge_block(self, size: int) -> None:
        """A block was written."""
        self._block_credit -= bytes_on_wire(size)

    def may_send_block(self) -> bool:
        """Whether a block that can wait may take room from overlays: on a narrow line they have a share of it, but not
        while too much is on its way as it is."""
        now, rate = self._clock(), self.window.throughput or 0.0
        self._block_credit += BLOCK_CREDIT_SHARE * rate * (now - self._credited_at) * 1e-6
        self._block_credit = min(self._block_credit, BLOCK_CREDIT_SHARE * rate * MAX_BLOCK_CREDIT_S)
        self._credited_at = now
        return self._block_credit > 0 and not self.is_slowing
