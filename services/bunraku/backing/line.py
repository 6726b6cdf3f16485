"""What the system knows of a socket's line: how much is not acknowledged, and its round trips (Linux, tcp(7))."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import sys
from typing import NamedTuple

from starlette.websockets import WebSocket

if sys.platform == "linux":
    import fcntl

EXTENSION = "bunraku.line"
"""The ASGI extension by which the server's protocol hands its transport to `line_of`."""
_OUTQ = 0x5411
"""SIOCOUTQ: bytes that were written and are not acknowledged."""
_NOUGHT = bytes(4)
_CORK = getattr(socket, "TCP_CORK", 3)
_TCP_INFO = getattr(socket, "TCP_INFO", 11)
_INFO = struct.Struct("=68xI48xQ20xI")
"""Where `tcpi_rtt`, `tcpi_bytes_acked` and `tcpi_min_rtt` stand in `struct tcp_info`, to whose end the kernel adds."""


class Reading(NamedTuple):
    """Bytes `waiting` for acknowledgement, the smoothed `round_trip` and the `least`, microseconds, and all bytes that
    were ever `written`, from a start of the system's own, never told as more than they are; 0: not known."""

    waiting: int
    round_trip: int
    least: int
    written: int = 0


class Line:
    """The line of one connected transport."""

    __slots__ = ("_socket", "_transport")

    def __init__(self, transport: asyncio.Transport) -> None:
        """Raises OSError where the system does not tell."""
        connected = transport.get_extra_info("socket")
        if sys.platform != "linux" or connected is None:
            raise OSError("only Linux tells what is on its way")
        self._transport = transport
        self._socket = connected
        self.read()

    def read(self) -> Reading:
        """How it stands now; raises OSError once the socket is closed."""
        number = self._socket.fileno()
        if number < 0:
            raise OSError("the socket is closed")
        # what is acknowledged between the two questions is counted in neither
        info = self._socket.getsockopt(socket.IPPROTO_TCP, _TCP_INFO, _INFO.size)
        waiting = int.from_bytes(fcntl.ioctl(number, _OUTQ, _NOUGHT), sys.byteorder)
        # what the transport has not handed to the system yet waits too
        waiting += self._transport.get_write_buffer_size()
        if len(info) < _INFO.size:
            return Reading(waiting, 0, 0)
        round_trip, acknowledged, least = _INFO.unpack(info)
        return Reading(waiting, round_trip, least, acknowledged + waiting)

    def hold(self, held: bool) -> None:
        """Keep what is written until a packet is full (for 200 ms at most), or let it go: at the start each packet of
        its own costs a narrow line the time of its heads."""
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.IPPROTO_TCP, _CORK, held)


def line_of(ws: WebSocket) -> Line | None:
    """The line of a WebSocket, None where its server or the system does not tell of it."""
    offered = (ws.scope.get("extensions") or {}).get(EXTENSION)
    if not offered:
        return None
    try:
        return Line(offered["transport"])
    except OSError:
        return None
