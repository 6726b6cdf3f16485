"""A viewer's socket, once it is open: bytes go straight to the transport, and there is no task for what comes back.

What goes to every viewer of a session thirty times a second is the same bytes, and a task and a queue for each of them
cost several times the writing. So a socket is accepted as any other (`bunraku.backing.direct`) and is then an `Outlet`,
which is all that stays of it: uvicorn's protocol, its task and the scope of the request are let go.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import Protocol, cast

from bunraku.backing.backing import clock
from bunraku.backing.frames import BrokenFrame, ClientFrames, Opcode, close_code, close_frame, frame
from bunraku.backing.sockets import BROKEN, TOO_LARGE, Refusal
from bunraku.wire.messages import LARGEST_FROM_CLIENT, Problem

CLOSING = 10.0
"""Seconds that a client has to answer a Close."""
KERNEL_BYTES = 32 << 10
"""What the kernel holds for a viewer, in payload of messages as they are here: Linux doubles the number that it is
given, and counts a buffer's own size. What lies there cannot be taken back when something newer is to be sent."""


class Listener(Protocol):
    """Who an outlet belongs to."""

    def hear(self, message: bytes) -> None:
        """A binary message came; raises `Refusal`, with which the outlet is closed."""

    def answered(self, payload: bytes) -> None:
        """A Ping that had something to say came back."""

    def pause(self) -> None:
        """Something stays behind: the outlet is not `clear` any more."""

    def resume(self) -> None:
        """All that was written is gone: the outlet is `clear` again."""

    def gone(self) -> None:
        """The connection has ended."""


class Outlet(asyncio.Protocol):
    """One open socket; it is the transport's protocol. `clear` says that all that was written has left the process, and
    `heard`, clock time in microseconds, when the other end last said anything."""

    __slots__ = (
        "_closing",
        "_connections",
        "_frames",
        "_listener",
        "_transport",
        "clear",
        "ended",
        "heard",
        "number",
        "write",
    )

    def __init__(self, transport: asyncio.Transport, listener: Listener, connections: set[object]) -> None:
        """`connections` are the server's, which shuts them down when it ends."""
        self._transport = transport
        self._listener = listener
        self._connections = connections
        self._frames = ClientFrames(LARGEST_FROM_CLIENT)
        self._closing: asyncio.TimerHandle | None = None
        self.clear = True
        self.heard = clock()
        self.ended: Callable[[], None] | None = None
        """Told once the connection has ended, beside its listener."""
        self.write = transport.write
        """Writes whole frames. Who writes only while `clear` keeps what waits to one write."""
        self.number: int | None = None
        """The socket's file descriptor, where what is written to it goes out as it is; valid until `gone`."""
        bare = transport.get_extra_info("socket")
        if bare is not None:
            if transport.get_extra_info("sslcontext") is None:
                self.number = bare.fileno()
            with contextlib.suppress(OSError):
                bare.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BYTES)
                # what is written goes at once; not every event loop sees to it
                bare.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        transport.set_protocol(self)
        # paused with the first byte that stays behind, resumed with the last one that leaves
        transport.set_write_buffer_limits(0, 0)
        connections.add(self)

    @property
    def waiting(self) -> int:
        """Bytes that were written and are still in the process."""
        return self._transport.get_write_buffer_size()

    @property
    def closing(self) -> bool:
        """Whether the other end was told that this is the end."""
        return self._closing is not None

    def ping(self) -> None:
        """Ask for a sign of life; it changes `heard`."""
        if self.clear and self._closing is None:
            self.write(frame(b"", Opcode.PING))

    def refuse(self, refusal: Refusal) -> None:
        """Say why, and close."""
        problem = frame(Problem(refusal.title, refusal.detail).pack())
        self._close(problem + close_frame(refusal.code, f"{refusal.title}: {refusal.detail}"))

    def abort(self) -> None:
        """End the connection with nothing said: nobody is there."""
        self._transport.abort()

    def shutdown(self) -> None:
        """The server ends."""
        self._close(close_frame(1012))
        self._transport.close()

    def _close(self, last: bytes) -> None:
        if self._closing is not None:
            return
        self.write(last)
        self.pause_writing()
        # closing at once, with something unread, would take back what was just said
        self._closing = asyncio.get_running_loop().call_later(CLOSING, self._transport.abort)

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        self.heard = clock()
        try:
            for opcode, payload in self._frames.read(data):
                self._take(opcode, payload)
        except BrokenFrame as broken:
            title = "Too large" if broken.code == TOO_LARGE else "Broken frame"
            self.refuse(Refusal(broken.code, title, broken.detail))
            # where the next frame begins nobody knows, nor what would be an answer to the Close
            self._transport.close()
        except Refusal as refusal:
            self.refuse(refusal)

    def _take(self, opcode: Opcode, payload: bytes) -> None:
        if opcode == Opcode.CLOSE:
            if self._closing is None:
                self.write(close_frame(close_code(payload)))
                self.pause_writing()
            self._transport.close()
        elif self._closing is not None or self._transport.is_closing():
            return
        elif opcode == Opcode.BINARY:
            self._listener.hear(payload)
        elif opcode == Opcode.TEXT:
            raise Refusal(BROKEN, "Text", "messages are binary")
        elif opcode == Opcode.PING and self.clear:
            self.write(frame(payload, Opcode.PONG))
        elif opcode == Opcode.PONG and payload:
            self._listener.answered(payload)

    def pause_writing(self) -> None:
        """As asyncio has it."""
        self.clear = False
        self._listener.pause()

    def resume_writing(self) -> None:
        """As asyncio has it."""
        if self._closing is None and not self._transport.is_closing():
            self.clear = True
            self._listener.resume()

    def connection_lost(self, _: Exception | None) -> None:
        """As asyncio has it."""
        self.clear = False
        self._connections.discard(self)
        if self._closing is not None:
            self._closing.cancel()
        if self.ended is not None:
            self.ended()
        self._listener.gone()


class _Shut:
    clear = False


SHUT = cast(Outlet, _Shut())
"""In place of an outlet that is not there yet: it is never clear."""
