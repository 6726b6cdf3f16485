"""What is known of a socket's line: how much is not acknowledged, and its round trips.

The system tells it of its own connection (Linux, tcp(7)). Behind a proxy that is the way to the proxy, so what is
written there is followed by a Ping, which the viewer's end answers by itself (RFC 6455, 5.5.2).
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
"""The ASGI extension by which the server's protocol hands its transport to `line_of`."""
PROXY_HEADERS = ("x-forwarded-for", "forwarded", "via")
"""Headers that say that a proxy is between."""
UNKNOWN_RTT_US = 1_000_000
"""The round trip of a line of which nothing was heard yet, microseconds."""
_ECHO_PAYLOAD = struct.Struct(">I")
_SIOCOUTQ = 0x5411
"""SIOCOUTQ: bytes that were written and are not acknowledged."""
_ZERO_INT = bytes(4)
_TCP_CORK = getattr(socket, "TCP_CORK", 3)
_TCP_CONGESTION = getattr(socket, "TCP_CONGESTION", 13)
_TCP_INFO = getattr(socket, "TCP_INFO", 11)
_TCP_INFO_LAYOUT = struct.Struct("=68xI48xQ20xI")
"""Where `tcpi_rtt`, `tcpi_bytes_acked` and `tcpi_min_rtt` stand in `struct tcp_info`, to whose end the kernel adds."""


class LinkSample(NamedTuple):
    """Bytes `waiting` for acknowledgement, the smoothed `round_trip` and the `least`, microseconds, and all bytes that
    were ever `written`, from a start of the system's own, never told as more than they are; 0: not known."""

    unacked_bytes: int
    rtt_us: int
    min_rtt_us: int
    written_bytes: int = 0


class TcpLink:
    """The line of one connected transport."""

    __slots__ = ("_socket", "_transport")

    def __init__(self, transport: asyncio.Transport) -> None:
        """Raises OSError where the system does not tell."""
        connected = transport.get_extra_info("socket")
        if sys.platform != "linux" or connected is None:
            raise OSError("only Linux tells what is on its way")
        self._transport = transport
        self._socket = connected
        self.sample()

    def sample(self) -> LinkSample:
        """How it stands now; raises OSError once the socket is closed."""
        number = self._socket.fileno()
        if number < 0:
            raise OSError("the socket is closed")
        # what is acknowledged between the two questions is counted in neither
        info = self._socket.getsockopt(socket.IPPROTO_TCP, _TCP_INFO, _TCP_INFO_LAYOUT.size)
        waiting = int.from_bytes(fcntl.ioctl(number, _SIOCOUTQ, _ZERO_INT), sys.byteorder)
        # what the transport has not handed to the system yet waits too
        waiting += self._transport.get_write_buffer_size()
        if len(info) < _TCP_INFO_LAYOUT.size:
            return LinkSample(waiting, 0, 0)
        round_trip, acknowledged, least = _TCP_INFO_LAYOUT.unpack(info)
        return LinkSample(waiting, round_trip, least, acknowledged + waiting)

    def probe(self, size: int) -> bytes:  # noqa: ARG002
        """Nothing need be written behind `size` bytes: the system knows what is acknowledged."""
        return b""

    def receive_probe_echo(self, payload: bytes) -> None:
        """Nothing was asked."""

    def set_corked(self, corked: bool) -> None:
        """Keep what is written until a packet is full (for 200 ms at most), or let it go: at the start each packet of
        its own costs a narrow line the time of its heads."""
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.IPPROTO_TCP, _TCP_CORK, corked)

    def use_loss_based_congestion(self) -> None:
        """Have the system hold back no more than loss asks for (Reno, RFC 5681, which every Linux has and allows): how
        much is on its way is ours to keep small, and BBR would hold what is newest for a round trip and 200 ms every
        10 s, to see the line with its queue empty (Cardwell et al. 2016, ProbeRTT)."""
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.IPPROTO_TCP, _TCP_CONGESTION, b"reno")


class AckedLink:
    """The line of a viewer behind a proxy: what was echoed has come. Nobody but the viewer itself suffers from echoes
    of what has not."""

    __slots__ = ("_acked_bytes", "_clock", "_min_rtt_us", "_pending_pings", "_rtt_us", "_written_bytes")

    def __init__(self, clock: Callable[[], int]) -> None:
        """`clock` tells microseconds."""
        self._clock = clock
        self._written_bytes = self._acked_bytes = 0
        # bytes written by then, and when, of each Ping that is on its way
        self._pending_pings: deque[tuple[int, int]] = deque()
        # until something is echoed it is taken for a far one
        self._rtt_us = UNKNOWN_RTT_US
        self._min_rtt_us = 0

    def sample(self) -> LinkSample:
        """How it stands now: bytes of which `asking` was told."""
        late = self._clock() - self._pending_pings[0][1] if self._pending_pings else 0
        return LinkSample(self._written_bytes - self._acked_bytes, max(self._rtt_us, late), self._min_rtt_us)

    def set_corked(self, corked: bool) -> None:
        """Nothing is held: the proxy sends as it likes."""

    def use_loss_based_congestion(self) -> None:
        """As the proxy likes."""

    def probe(self, size: int) -> bytes:
        """What is to be written right behind `size` bytes; of none a Ping alone, where none is on its way."""
        if not size and self._pending_pings:
            return b""
        self._written_bytes += size
        self._pending_pings.append((self._written_bytes, self._clock()))
        return encode_frame(_ECHO_PAYLOAD.pack(self._written_bytes & 0xFFFF_FFFF), Opcode.PING)

    def receive_probe_echo(self, payload: bytes) -> None:
        """A Pong came; one that answers nothing that is on its way says nothing."""
        for nth, (written, at) in enumerate(self._pending_pings):
            if payload == _ECHO_PAYLOAD.pack(written & 0xFFFF_FFFF):
                for _ in range(nth + 1):
                    self._pending_pings.popleft()
                self._acked_bytes = written
                self._rtt_us = max(self._clock() - at, 1)
                self._min_rtt_us = min(self._min_rtt_us or self._rtt_us, self._rtt_us)
                return


def link_of(ws: WebSocket) -> TcpLink | AckedLink | None:
    """The line of a WebSocket, None where its server or the system does not tell of it."""
    if any(name in ws.headers for name in PROXY_HEADERS):
        return AckedLink(clock)
    offered = (ws.scope.get("extensions") or {}).get(LINK_EXTENSION)
    if not offered:
        return None
    try:
        return TcpLink(offered["transport"])
    except OSError:
        return None
