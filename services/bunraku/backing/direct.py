"""A way past the queue to a WebSocket: a message framed once is written to many sockets at once.

What goes to every viewer of a session thirty times a second is the same bytes, and a task woken for each of them costs
ten times the writing. So the server's protocol offers to applications, as an ASGI extension of its own, to write a
whole frame straight to the transport, if that has nothing else to write. A server without it, and a socket that is not
ready, are served the usual way.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from starlette.websockets import WebSocket
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from bunraku.backing import line

EXTENSION = "bunraku.write"
Write = Callable[[bytes], bool]
"""Writes a whole frame; False, and nothing is written, where the socket is not ready for it."""


def frame(message: bytes) -> bytes:
    """A server's frame of a binary message, whole and unmasked (RFC 6455, section 5.2)."""
    size = len(message)
    if size < 126:
        return bytes((0x82, size)) + message
    if size < 1 << 16:
        return struct.pack(">BBH", 0x82, 126, size) + message
    return struct.pack(">BBQ", 0x82, 127, size) + message


class DirectProtocol(WebSocketsSansIOProtocol):
    """uvicorn's protocol, with the extension."""

    def handle_connect(self, event: Request) -> None:
        """As the base has it; the application's task starts after this."""
        super().handle_connect(event)
        if not self.close_sent:
            extensions = self.scope["extensions"]
            assert extensions is not None
            extensions[EXTENSION] = {"write": self.write_frame}
            extensions[line.EXTENSION] = {"transport": self.transport}

    def write_frame(self, data: bytes) -> bool:
        """As `Write`."""
        transport = self.transport
        if not self.handshake_complete or self.close_sent or self.disconnected or transport.is_closing():
            return False
        if transport.get_write_buffer_size() > 0:
            return False
        transport.write(data)
        return True


def writer(socket: WebSocket) -> Write | None:
    """The socket's own way past the queue, None where its server has none."""
    offered = (socket.scope.get("extensions") or {}).get(EXTENSION)
    return offered["write"] if offered else None
