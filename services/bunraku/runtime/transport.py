"""Bounds on a client's connection: the progress of writes, and the end of a connection that was rejected."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import Callable

if sys.platform == "linux":
    import fcntl

WRITE_WINDOW_S = 30.0
"""Interval at which the progress of a connection with unsent data is checked."""
MIN_WINDOW_BYTES = 15_000
"""Bytes that a client must receive in each interval while data waits for it: half of what a 9.6 kbit/s link carries."""
LINGER_S = 2.0
"""Time for a rejected client to read the reason. Closing a socket with unread input at once would discard it."""
LINGER_READ_INTERVAL_S = 0.1
"""Interval at which the input of a rejected client is read and discarded."""
_SIOCOUTQ = 0x5411
"""ioctl for the number of written bytes that are not acknowledged (tcp(7))."""
_ZERO_INT = bytes(4)


class WriteDeadline:
    """Abort of a connection whose client does not receive what was written.

    The owner calls `start` when the transport has buffered data and `stop` when its buffer is empty, which are the
    events `pause_writing` and `resume_writing` of a protocol with write buffer limits of 0.
    """

    __slots__ = ("_timer", "_transport", "_unsent_bytes")

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self._unsent_bytes = 0
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Require progress from now on."""
        if self._timer is None:
            self._unsent_bytes = unsent_bytes(self._transport)
            self._schedule()

    def stop(self) -> None:
        """Require nothing: no data waits, or the connection has ended."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _schedule(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(WRITE_WINDOW_S, self._check)

    def _check(self) -> None:
        unsent = unsent_bytes(self._transport)
        if self._unsent_bytes - unsent < MIN_WINDOW_BYTES:
            self._timer = None
            self._transport.abort()
        else:
            self._unsent_bytes = unsent
            self._schedule()


def unsent_bytes(transport: asyncio.Transport) -> int:
    """Return the number of written bytes that the client has not acknowledged, on Linux; elsewhere, those in the
    process."""
    buffered = transport.get_write_buffer_size()
    connected: socket.socket | None = transport.get_extra_info("socket")
    if sys.platform != "linux" or connected is None or connected.fileno() < 0:
        return buffered
    try:
        return buffered + int.from_bytes(fcntl.ioctl(connected.fileno(), _SIOCOUTQ, _ZERO_INT), sys.byteorder)
    except OSError:
        return buffered


def set_send_buffer(transport: asyncio.BaseTransport, size: int) -> None:
    """Limit the kernel's send buffer of a connection.

    Linux doubles `size` and counts the overhead of its buffers, so that about as much payload fits in typical messages.
    """
    _set_buffer(transport, socket.SO_SNDBUF, size)


def set_receive_buffer(transport: asyncio.BaseTransport, size: int) -> None:
    """Limit the kernel's receive buffer of a connection, and with it what arrives at once. See `set_send_buffer`."""
    _set_buffer(transport, socket.SO_RCVBUF, size)


def _set_buffer(transport: asyncio.BaseTransport, option: int, size: int) -> None:
    connected: socket.socket | None = transport.get_extra_info("socket")
    if connected is not None:
        with contextlib.suppress(OSError):
            connected.setsockopt(socket.SOL_SOCKET, option, size)


class LingeringClose(asyncio.Protocol):
    """Protocol that takes over the transport of a rejected client, and ends the connection.

    It discards input slowly, so that a flood costs nothing, until the client closes the connection, at most for
    `LINGER_S`.
    """

    def __init__(self, transport: asyncio.Transport, on_lost: Callable[[Exception | None], None]) -> None:
        """Take over `transport` after the reason was written; `on_lost` is called when the connection has ended."""
        self._transport = transport
        self._on_lost = on_lost
        loop = asyncio.get_running_loop()
        self._abort_timer = loop.call_later(LINGER_S, transport.abort)
        self._read_timer: asyncio.TimerHandle | None = None
        transport.set_protocol(self)
        self._pause()

    def data_received(self, _: bytes) -> None:
        self._pause()

    def connection_lost(self, exc: Exception | None) -> None:
        self._abort_timer.cancel()
        if self._read_timer is not None:
            self._read_timer.cancel()
        self._on_lost(exc)

    def _pause(self) -> None:
        self._transport.pause_reading()
        self._read_timer = asyncio.get_running_loop().call_later(LINGER_READ_INTERVAL_S, self._transport.resume_reading)
