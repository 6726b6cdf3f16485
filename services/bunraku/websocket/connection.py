"""A viewer's socket, once it is open: bytes go straight to the transport, and there is no task for what comes back.

What goes to every viewer of a session thirty times a second is the same bytes, and a task and a queue for each of them
cost several times the writing. So a socket is accepted as any other (`bunraku.websocket.handoff`) and is then an `Outlet`,
which is all that stays of it: uvicorn's protocol, its task and the scope of the request are let go.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import Protocol, cast

from bunraku.runtime.clock import clock
from bunraku.websocket.frame import (
    ClientFrameParser,
    FrameError,
    Opcode,
    encode_close_frame,
    encode_frame,
    parse_close_code,
)
from bunraku.websocket.subprotocol import MESSAGE_TOO_BIG, POLICY_VIOLATION, CloseConnection
from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES, Problem

CLOSE_TIMEOUT_S = 10.0
"""Seconds that a client has to answer a Close."""
SEND_BUFFER_BYTES = 32 << 10
"""What the kernel holds for a viewer, in payload of messages as they are here: Linux doubles the number that it is
given, and counts a buffer's own size. What lies there cannot be taken back when something newer is to be sent."""


class ConnectionListener(Protocol):
    """Who an outlet belongs to."""

    def on_message(self, message: bytes) -> None:
        """A binary message came; raises `Refusal`, with which the outlet is closed."""

    def on_pong(self, payload: bytes) -> None:
        """A Ping that had something to say came back."""

    def on_pause(self) -> None:
        """Something stays behind: the outlet is not `clear` any more."""

    def on_resume(self) -> None:
        """All that was written is gone: the outlet is `clear` again."""

    def on_close(self) -> None:
        """The connection has ended."""


class WebSocketConnection(asyncio.Protocol):
    """One open socket; it is the transport's protocol. `clear` says that all that was written has left the process, and
    `heard`, clock time in microseconds, when the other end last said anything."""

    __slots__ = (
        "_close_timer",
        "_connections",
        "_listener",
        "_parser",
        "_transport",
        "file_descriptor",
        "is_writable",
        "last_received_at",
        "on_ended",
        "write",
    )

    def __init__(self, transport: asyncio.Transport, listener: ConnectionListener, connections: set[object]) -> None:
        """`connections` are the server's, which shuts them down when it ends."""
        self._transport = transport
        self._listener = listener
        self._connections = connections
        self._parser = ClientFrameParser(MAX_CLIENT_MESSAGE_BYTES)
        self._close_timer: asyncio.TimerHandle | None = None
        self.is_writable = True
        self.last_received_at = clock()
        self.on_ended: Callable[[], None] | None = None
        """Told once the connection has ended, beside its listener."""
        self.write = transport.write
        """Writes whole frames. Who writes only while `clear` keeps what waits to one write."""
        self.file_descriptor: int | None = None
        """The socket's file descriptor, where what is written to it goes out as it is; valid until `gone`."""
        bare = transport.get_extra_info("socket")
        if bare is not None:
            if transport.get_extra_info("sslcontext") is None:
                self.file_descriptor = bare.fileno()
            with contextlib.suppress(OSError):
                bare.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
                # what is written goes at once; not every event loop sees to it
                bare.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        transport.set_protocol(self)
        # paused with the first byte that stays behind, resumed with the last one that leaves
        transport.set_write_buffer_limits(0, 0)
        connections.add(self)

    @property
    def buffered_bytes(self) -> int:
        """Bytes that were written and are still in the process."""
        return self._transport.get_write_buffer_size()

    @property
    def is_closing(self) -> bool:
        """Whether the other end was told that this is the end."""
        return self._close_timer is not None

    def send_ping(self) -> None:
        """Ask for a sign of life; it changes `heard`."""
        if self.is_writable and self._close_timer is None:
            self.write(encode_frame(b"", Opcode.PING))

    def close_with_problem(self, reason: CloseConnection) -> None:
        """Say why, and close."""
        problem = encode_frame(Problem(reason.title, reason.detail).pack())
        self._close(problem + encode_close_frame(reason.code, f"{reason.title}: {reason.detail}"))

    def abort(self) -> None:
        """End the connection with nothing said: nobody is there."""
        self._transport.abort()

    def shutdown(self) -> None:
        """The server ends."""
        self._close(encode_close_frame(1012))
        self._transport.close()

    def _close(self, final_bytes: bytes) -> None:
        if self._close_timer is not None:
            return
        self.write(final_bytes)
        self.pause_writing()
        # closing at once, with something unread, would take back what was just said
        self._close_timer = asyncio.get_running_loop().call_later(CLOSE_TIMEOUT_S, self._transport.abort)

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        self.last_received_at = clock()
        try:
            for opcode, payload in self._parser.parse(data):
                self._handle_frame(opcode, payload)
        except FrameError as broken:
            title = "Too large" if broken.code == MESSAGE_TOO_BIG else "Broken frame"
            self.close_with_problem(CloseConnection(broken.code, title, broken.detail))
            # where the next frame begins nobody knows, nor what would be an answer to the Close
            self._transport.close()
        except CloseConnection as refusal:
            self.close_with_problem(refusal)

    def _handle_frame(self, opcode: Opcode, payload: bytes) -> None:
        if opcode == Opcode.CLOSE:
            if self._close_timer is None:
                self.write(encode_close_frame(parse_close_code(payload)))
                self.pause_writing()
            self._transport.close()
        elif self._close_timer is not None or self._transport.is_closing():
            return
        elif opcode == Opcode.BINARY:
            self._listener.on_message(payload)
        elif opcode == Opcode.TEXT:
            raise CloseConnection(POLICY_VIOLATION, "Text", "messages are binary")
        elif opcode == Opcode.PING and self.is_writable:
            self.write(encode_frame(payload, Opcode.PONG))
        elif opcode == Opcode.PONG and payload:
            self._listener.on_pong(payload)

    def pause_writing(self) -> None:
        """As asyncio has it."""
        self.is_writable = False
        self._listener.on_pause()

    def resume_writing(self) -> None:
        """As asyncio has it."""
        if self._close_timer is None and not self._transport.is_closing():
            self.is_writable = True
            self._listener.on_resume()

    def connection_lost(self, _: Exception | None) -> None:
        """As asyncio has it."""
        self.is_writable = False
        self._connections.discard(self)
        if self._close_timer is not None:
            self._close_timer.cancel()
        if self.on_ended is not None:
            self.on_ended()
        self._listener.on_close()


class _ClosedConnection:
    is_writable = False


CLOSED_CONNECTION = cast(WebSocketConnection, _ClosedConnection())
"""In place of an outlet that is not there yet: it is never clear."""
