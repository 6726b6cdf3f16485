"""Simulated link in virtual time.

A transmitter with a throughput, a fixed delay, and a receiver that acknowledges as TCP does: after 536 bytes, or after
60 ms. Times are microseconds, throughputs bytes/s on the wire.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from bunraku.delivery.congestion import bytes_on_wire

DELAYED_ACK_US = 60_000
"""Delay of an acknowledgement, microseconds."""
ACK_BYTES = 536
"""Bytes after which the receiver acknowledges without a delay."""


class VirtualLink:
    """One direction of a link, and the acknowledgements of the other."""

    def __init__(self, throughput_at: Callable[[int], float], delay: int) -> None:
        """`throughput_at` returns the throughput at an instant; `delay` is the one-way delay."""
        self._throughput_at = throughput_at
        self._delay = delay
        self._idle_at = 0.0
        self._written = 0
        # arrival time and end of each packet, in bytes written
        self._arriving: deque[tuple[float, int]] = deque()
        self._returning_acks: deque[tuple[float, int]] = deque()
        self._unacked: list[tuple[float, int]] = []
        self._receiver_acked = 0
        self._sender_acked = 0
        self.sent_bytes = 0

    def write(self, at: int, size: int) -> float:
        """Send a message of `size` bytes; return its arrival time."""
        start = max(float(at), self._idle_at)
        self._idle_at = start + bytes_on_wire(size) / self._throughput_at(int(start)) * 1e6
        self._written += size
        self.sent_bytes += bytes_on_wire(size)
        arrives = self._idle_at + self._delay
        self._arriving.append((arrives, self._written))
        return arrives

    def unacked_bytes(self, at: int) -> int:
        """Return the bytes that are not acknowledged at `at`, as the sender's kernel knows them."""
        while self._arriving and self._arriving[0][0] <= at:
            arrived, end = self._arriving.popleft()
            self._fire_ack_timer(arrived)
            self._unacked.append((arrived, end))
            if end - self._receiver_acked > ACK_BYTES:
                self._send_ack(arrived, end)
        self._fire_ack_timer(at)
        while self._returning_acks and self._returning_acks[0][0] <= at:
            self._sender_acked = self._returning_acks.popleft()[1]
        return self._written - self._sender_acked

    def _fire_ack_timer(self, at: float) -> None:
        if self._unacked and self._unacked[0][0] + DELAYED_ACK_US <= at:
            self._send_ack(self._unacked[0][0] + DELAYED_ACK_US, self._unacked[-1][1])

    def _send_ack(self, at: float, end: int) -> None:
        self._returning_acks.append((at + self._delay, end))
        self._receiver_acked = end
        self._unacked.clear()
