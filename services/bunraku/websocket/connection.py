"""Server side of an open WebSocket connection, directly on the transport.

Every viewer of a session receives the same bytes thirty times a second. A task and a queue per viewer would cost
several times as much as the write itself. Therefore a connection is accepted like any other and then detached from
ASGI (`bunraku.websocket.handoff`): only a `WebSocketConnection` remains; uvicorn's protocol, its task and the request
scope are released.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import NamedTuple, Protocol, cast

from bunraku.runtime.client_network import peer_network
from bunraku.runtime.clock import clock
from bunraku.runtime.input_scheduler import TURN_US, InputScheduler
from bunraku.runtime.token_bucket import TokenBucket
from bunraku.runtime.transport import LingeringClose, WriteDeadline, set_send_buffer
from bunraku.websocket.frame import (
    MESSAGE_TOO_BIG,
    ClientFrameParser,
    FrameError,
    Opcode,
    encode_close_frame,
    encode_frame,
    parse_close_code,
)
from bunraku.websocket.subprotocol import POLICY_VIOLATION, SERVICE_RESTART, CloseConnection
from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES, Problem

CLOSE_TIMEOUT_S = 10.0
"""Time for the client to answer a Close frame."""
SEND_BUFFER_BYTES = 32 << 10
"""Kernel send buffer of a viewer. Data in this buffer cannot be replaced when newer data is to be sent."""


FRAMES_PER_TURN = 16
"""Frames of one connection that are handled before those of other connections."""


class FrameLimit(NamedTuple):
    """Limit on the frames of one connection: so many per second, and so many at once.

    A client above it is disconnected. A read that completes no frame counts as one. Pongs that answer a Ping of this
    side do not count. A message may have `max_bytes`.
    """

    rate: float
    burst: float
    max_bytes: int = MAX_CLIENT_MESSAGE_BYTES


VIEWER_FRAMES = FrameLimit(40.0, 120.0)
"""Limit of a viewer, which sends some messages per second."""


class ConnectionListener(Protocol):
    """Owner of a connection, called for its events."""

    def on_message(self, message: bytes) -> None:
        """Handle a binary message. Raise `CloseConnection` to close the connection."""

    def on_text(self, text: bytes) -> None:
        """Handle a text message, which may not be UTF-8. Raise `CloseConnection` to close the connection."""

    def on_pong(self, payload: bytes) -> bool:
        """Handle a Pong with a payload. Return whether it answers a Ping."""

    def on_pause(self) -> None:
        """Handle that the connection is no longer writable: the transport has buffered data."""

    def on_resume(self) -> None:
        """Handle that the connection is writable again: the transport's buffer is empty."""

    def on_close(self) -> None:
        """Handle the end of the connection."""


class BinaryListener:
    """Base of listeners that accept binary messages only."""

    __slots__ = ()

    def on_text(self, text: bytes) -> None:  # noqa: ARG002
        """Reject a text message."""
        raise CloseConnection(POLICY_VIOLATION, "Text", "received a text message; messages are binary")


class _NoListener:
    def on_message(self, message: bytes) -> None:
        pass

    def on_text(self, text: bytes) -> None:
        pass

    def on_pong(self, payload: bytes) -> bool:  # noqa: ARG002
        return False

    def on_pause(self) -> None:
        pass

    def on_resume(self) -> None:
        pass

    def on_close(self) -> None:
        pass


NO_LISTENER: ConnectionListener = _NoListener()
"""Listener for a connection that is closing, whose events concern nobody."""


class WebSocketConnection(asyncio.Protocol):
    """Open WebSocket connection, the protocol of its transport.

    `is_writable` is true while all written data has left the process. `last_received_at` is the clock time, in
    microseconds, at which the client last sent anything.
    """

    __slots__ = (
        "_clock",
        "_close_timer",
        "_connections",
        "_frames",
        "_input",
        "_listener",
        "_parser",
        "_transport",
        "_write_deadline",
        "file_descriptor",
        "is_writable",
        "last_received_at",
        "on_ended",
        "source",
        "write",
    )

    def __init__(
        self,
        transport: asyncio.Transport,
        listener: ConnectionListener,
        connections: set[object],
        clock: Callable[[], int] = clock,
        limit: FrameLimit = VIEWER_FRAMES,
        *,
        scheduler: InputScheduler | None = None,
        source: str | None = None,
    ) -> None:
        """Take over `transport`. The server calls `shutdown` on all members of `connections` when it stops.

        Connections that share a `scheduler` are handled in turns. `source` is the network of the client if a proxy is
        the peer.
        """
        self._transport = transport
        self._listener = listener
        self._connections = connections
        self._clock = clock
        self._input = scheduler or InputScheduler(TURN_US, clock)
        self._parser = ClientFrameParser(limit.max_bytes)
        self.source = peer_network(transport) if source is None else source
        self._close_timer: asyncio.TimerHandle | None = None
        self._write_deadline: WriteDeadline | None = None
        self.is_writable = True
        self.last_received_at = clock()
        self._frames = TokenBucket(limit.rate, limit.burst, self.last_received_at * 1e-6)
        self.on_ended: Callable[[], None] | None = None
        """Called once when the connection has ended, before `ConnectionListener.on_close`."""
        self.write = transport.write
        """Write whole frames. A caller that writes only while `is_writable` has at most one write buffered."""
        self.file_descriptor: int | None = None
        """Descriptor of the socket, None for an encrypted connection. Valid until `ConnectionListener.on_close`."""
        raw_socket = transport.get_extra_info("socket")
        if raw_socket is not None:
            if transport.get_extra_info("sslcontext") is None:
                self.file_descriptor = raw_socket.fileno()
            set_send_buffer(transport, SEND_BUFFER_BYTES)
            with contextlib.suppress(OSError):
                # not every event loop sets this
                raw_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        transport.set_protocol(self)
        # pause at the first buffered byte, resume when the buffer is empty
        transport.set_write_buffer_limits(0, 0)
        connections.add(self)

    @property
    def buffered_bytes(self) -> int:
        """Number of written bytes that are still in the process."""
        return self._transport.get_write_buffer_size()

    @property
    def is_closing(self) -> bool:
        """True if this side has sent a Close frame first."""
        return self._close_timer is not None

    def send_ping(self) -> None:
        """Send an empty Ping. The Pong updates `last_received_at`."""
        if self.is_writable and self._close_timer is None:
            self.write(encode_frame(b"", Opcode.PING))

    def close_with_problem(self, reason: CloseConnection) -> None:
        """Send a Problem message, then close the connection."""
        problem = encode_frame(Problem(reason.title, reason.detail).pack())
        self._close(problem + encode_close_frame(reason.code, f"{reason.title}: {reason.detail}"))

    def abort(self) -> None:
        """Close the connection without a Close frame, for a client that does not respond."""
        self._transport.abort()

    def shutdown(self) -> None:
        """Close the connection because the server stops."""
        self._close(encode_close_frame(SERVICE_RESTART))
        self._transport.close()

    def _close(self, final_bytes: bytes) -> None:
        if self._close_timer is not None:
            return
        self.write(final_bytes)
        self.is_writable = False
        self._listener.on_pause()
        # closing a socket with unread input at once would discard the bytes just written
        self._close_timer = asyncio.get_running_loop().call_later(CLOSE_TIMEOUT_S, self._transport.abort)

    def pause_reading(self) -> None:
        """Read nothing from the client while received frames wait for their turn."""
        self._transport.pause_reading()

    def resume_reading(self) -> None:
        """Read from the client again."""
        if self._transport.get_protocol() is self and not self._transport.is_closing():
            self._transport.resume_reading()

    def data_received(self, data: bytes) -> None:
        self.last_received_at = self._clock()
        self._parser.append(data)
        self._input.schedule(self)

    def handle_input(self) -> bool:
        """Handle up to `FRAMES_PER_TURN` received frames. Return whether more may be left."""
        if self._transport.is_closing():
            return False
        handled, ping, is_interrupted = 0, None, False
        frames = self._parser.parse()
        try:
            for opcode, payload in frames:
                self._count_frame()
                handled += 1
                if opcode == Opcode.PING:
                    ping = payload
                else:
                    self._handle_frame(opcode, payload)
                if handled == FRAMES_PER_TURN:
                    break
            if not handled:
                self._count_frame()
        except FrameError as error:
            title = "Too large" if error.code == MESSAGE_TOO_BIG else "Broken frame"
            self._reject(CloseConnection(error.code, title, error.detail))
        except _TooManyFrames:
            self._reject(CloseConnection(POLICY_VIOLATION, "Too many messages", "messages arrive too fast; send fewer"))
        except CloseConnection as reason:
            self.close_with_problem(reason)
            # a Close frame may follow, which ends the connection at once
            is_interrupted = True
        finally:
            frames.close()
        if ping is not None and self.is_writable and self._close_timer is None:
            # one Pong for the most recent Ping (RFC 6455, section 5.5.3)
            self.write(encode_frame(ping, Opcode.PONG))
        return (is_interrupted or handled == FRAMES_PER_TURN) and self._parser.has_unparsed_data

    def _count_frame(self) -> None:
        if not self._frames.take(self.last_received_at * 1e-6):
            raise _TooManyFrames

    def _handle_frame(self, opcode: Opcode, payload: bytes) -> None:
        if opcode == Opcode.CLOSE:
            self._close(encode_close_frame(parse_close_code(payload)))
            self._transport.close()
        elif self._close_timer is not None or self._transport.is_closing():
            return
        elif opcode == Opcode.BINARY:
            self._listener.on_message(payload)
        elif opcode == Opcode.TEXT:
            self._listener.on_text(payload)
        elif opcode == Opcode.PONG and payload and self._listener.on_pong(payload):
            self._frames.give_back()

    def _reject(self, reason: CloseConnection) -> None:
        """Close the connection of a client whose input is not parsed any more."""
        self.close_with_problem(reason)
        LingeringClose(self._transport, self.connection_lost)

    def pause_writing(self) -> None:
        self.is_writable = False
        if self._write_deadline is None:
            self._write_deadline = WriteDeadline(self._transport)
        self._write_deadline.start()
        self._listener.on_pause()

    def resume_writing(self) -> None:
        if self._write_deadline is not None:
            self._write_deadline.stop()
        if self._close_timer is None and not self._transport.is_closing():
            self.is_writable = True
            self._listener.on_resume()

    def connection_lost(self, _: Exception | None) -> None:
        self.is_writable = False
        self._connections.discard(self)
        if self._close_timer is not None:
            self._close_timer.cancel()
        if self._write_deadline is not None:
            self._write_deadline.stop()
        # without these references connection and listener are freed at once
        listener, self._listener = self._listener, NO_LISTENER
        on_ended, self.on_ended = self.on_ended, None
        if on_ended is not None:
            on_ended()
        listener.on_close()


class _TooManyFrames(Exception):
    pass


class _ClosedConnection:
    is_writable = False


CLOSED_CONNECTION = cast(WebSocketConnection, _ClosedConnection())
"""Placeholder for a connection that is not open yet. It is never writable."""
