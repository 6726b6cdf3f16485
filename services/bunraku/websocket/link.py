"""State of the network link to a viewer: unacknowledged bytes and round-trip time.

On Linux the kernel reports both for a TCP connection (tcp(7)). Behind a proxy the kernel sees only the connection to
the proxy. There, each write is followed by a Ping, which the viewer answers by itself (RFC 6455, section 5.5.2).
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import sys
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from starlette.websockets import WebSocket

from bunraku.runtime.clock import clock
from bunraku.websocket.frame import Opcode, encode_frame

if sys.platform == "linux":
    import fcntl

LINK_EXTENSION = "bunraku.line"
"""ASGI extension in which the server's protocol passes its transport to `link_of`."""
PROXY_HEADERS = ("x-forwarded-for", "forwarded", "via")
"""Request headers that a proxy adds."""
UNKNOWN_RTT_US = 1_000_000
"""Round-trip time assumed before the first measurement, in microseconds."""
_ECHO_PAYLOAD = struct.Struct(">I")
_SIOCOUTQ = 0x5411
"""ioctl for the number of written bytes that are not acknowledged."""
_ZERO_INT = bytes(4)
_TCP_CORK = getattr(socket, "TCP_CORK", 3)
_TCP_CONGESTION = getattr(socket, "TCP_CONGESTION", 13)
_TCP_INFO = getattr(socket, "TCP_INFO", 11)
_TCP_INFO_LAYOUT = struct.Struct("=68xI48xQ20xI")
"""Fields `tcpi_rtt`, `tcpi_bytes_acked` and `tcpi_min_rtt` of `struct tcp_info`. Newer kernels append fields only."""


class LinkSample(NamedTuple):
    """Measurement of a link. A value of 0 means unknown, except for `unacked_bytes`.

    `rtt_us` is the smoothed round-trip time and `min_rtt_us` the minimum, in microseconds. `written_bytes` counts all
    written bytes from an arbitrary start, and never too many.
    """

    unacked_bytes: int
    rtt_us: int
    min_rtt_us: int
    written_bytes: int = 0


class TcpLink:
    """Link of a direct TCP connection, measured by the kernel."""

    __slots__ = ("_socket", "_transport")

    def __init__(self, transport: asyncio.Transport) -> None:
        """Raise OSError if the system does not report the state of TCP connections."""
        connected = transport.get_extra_info("socket")
        if sys.platform != "linux" or connected is None:
            raise OSError("the state of a TCP connection is available on Linux only")
        self._transport = transport
        self._socket = connected
        self.sample()

    def sample(self) -> LinkSample:
        """Measure the link. Raises OSError once the socket is closed."""
        descriptor = self._socket.fileno()
        if descriptor < 0:
            raise OSError("the socket is closed")
        # bytes acknowledged between the two system calls are counted in neither, so `written_bytes` is never too large
        info = self._socket.getsockopt(socket.IPPROTO_TCP, _TCP_INFO, _TCP_INFO_LAYOUT.size)
        unacked = int.from_bytes(fcntl.ioctl(descriptor, _SIOCOUTQ, _ZERO_INT), sys.byteorder)
        # bytes in the transport's buffer have not reached the kernel yet
        unacked += self._transport.get_write_buffer_size()
        if len(info) < _TCP_INFO_LAYOUT.size:
            return LinkSample(unacked, 0, 0)
        rtt, acked, min_rtt = _TCP_INFO_LAYOUT.unpack(info)
        return LinkSample(unacked, rtt, min_rtt, acked + unacked)

    def probe(self, size: int) -> bytes:  # noqa: ARG002
        """Return no bytes: the kernel tracks acknowledgements."""
        return b""

    def receive_probe_echo(self, payload: bytes) -> bool:  # noqa: ARG002
        """Ignore a Pong: `probe` sends no Ping."""
        return False

    def set_corked(self, corked: bool) -> None:
        """Hold written data until a packet is full, for at most 200 ms, or release it.

        At the start of a stream, the headers of each separate packet take noticeable time on a constrained link.
        """
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.IPPROTO_TCP, _TCP_CORK, corked)

    def use_loss_based_congestion(self) -> None:
        """Select Reno congestion control (RFC 5681), which every Linux system has and permits.

        The sender keeps the amount of data in flight small by itself. BBR would delay the newest data by a round trip
        and 200 ms every 10 s, to measure the link with an empty queue (Cardwell et al. 2016, ProbeRTT).
        """
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.IPPROTO_TCP, _TCP_CONGESTION, b"reno")


class AckedLink:
    """Link of a viewer behind a proxy, measured by Ping and Pong.

    A viewer that sends Pongs for data it has not received harms only itself.
    """

    __slots__ = ("_acked_bytes", "_clock", "_min_rtt_us", "_pending_pings", "_rtt_us", "_written_bytes")

    def __init__(self, clock: Callable[[], int]) -> None:
        """`clock` returns microseconds."""
        self._clock = clock
        self._written_bytes = self._acked_bytes = 0
        # for each unanswered Ping: total bytes written before it, and its time
        self._pending_pings: deque[tuple[int, int]] = deque()
        self._rtt_us = UNKNOWN_RTT_US
        self._min_rtt_us = 0

    def sample(self) -> LinkSample:
        """Return the state of the link, counting the bytes passed to `probe`."""
        waiting_us = self._clock() - self._pending_pings[0][1] if self._pending_pings else 0
        return LinkSample(self._written_bytes - self._acked_bytes, max(self._rtt_us, waiting_us), self._min_rtt_us)

    def set_corked(self, corked: bool) -> None:
        """Do nothing: the proxy decides when it sends."""

    def use_loss_based_congestion(self) -> None:
        """Do nothing: the proxy has its own congestion control."""

    def probe(self, size: int) -> bytes:
        """Return the Ping to write directly after `size` bytes.

        For a size of 0, return a Ping only if none is unanswered.
        """
        if not size and self._pending_pings:
            return b""
        self._written_bytes += size
        self._pending_pings.append((self._written_bytes, self._clock()))
        return encode_frame(_ECHO_PAYLOAD.pack(self._written_bytes & 0xFFFF_FFFF), Opcode.PING)

    def receive_probe_echo(self, payload: bytes) -> bool:
        """Handle a Pong. Return False if it answers no pending Ping."""
        for index, (written_bytes, sent_at) in enumerate(self._pending_pings):
            if payload == _ECHO_PAYLOAD.pack(written_bytes & 0xFFFF_FFFF):
                for _ in range(index + 1):
                    self._pending_pings.popleft()
                self._acked_bytes = written_bytes
                self._rtt_us = max(self._clock() - sent_at, 1)
                self._min_rtt_us = min(self._min_rtt_us or self._rtt_us, self._rtt_us)
                return True
        return False


def link_of(ws: WebSocket, clock: Callable[[], int] = clock) -> TcpLink | AckedLink | None:
    """Return the link of a WebSocket, None if its state is not available."""
    if any(name in ws.headers for name in PROXY_HEADERS):
        return AckedLink(clock)
    extension = (ws.scope.get("extensions") or {}).get(LINK_EXTENSION)
    if not extension:
        return None
    try:
        return TcpLink(extension["transport"])
    except OSError:
        return None
