"""Hand-off of an accepted WebSocket from ASGI to the application.

`HandoffProtocol` offers an ASGI extension with which an application takes over the connection. From then on the
application writes to the transport and receives its data directly.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import cast

from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from bunraku.runtime.clock import clock
from bunraku.websocket import link
from bunraku.websocket.connection import ConnectionListener, WebSocketConnection

HANDOFF_EXTENSION = "bunraku.take"


class _DetachedTransport(asyncio.Transport):
    """Inert transport for uvicorn's protocol after the hand-off."""

    def close(self) -> None:
        pass

    def is_closing(self) -> bool:
        return True


_DETACHED_TRANSPORT = _DetachedTransport()


class HandoffProtocol(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket protocol with the hand-off extension.

    It uses attributes of the base class that uvicorn does not document; `pyproject.toml` bounds its version, and
    `tests/test_library_interfaces.py` checks them.
    """

    def handle_connect(self, event: Request) -> None:
        # the application's task starts after this call, so it sees the extensions
        super().handle_connect(event)
        if not self.close_sent:
            extensions = self.scope["extensions"]
            assert extensions is not None
            extensions[HANDOFF_EXTENSION] = {"take": self.detach}
            extensions[link.LINK_EXTENSION] = {"transport": self.transport}

    def detach(self, listener: ConnectionListener, clock: Callable[[], int]) -> WebSocketConnection | None:
        """Return the accepted connection, None if it has ended.

        Raises RuntimeError if data was already read from it.
        """
        transport = self.transport
        if not self.handshake_complete or self.close_sent or self.disconnected or transport.is_closing():
            return None
        if not self.queue.empty() or self.conn.reader.buffer:
            raise RuntimeError("data was read from the connection before its hand-off")
        self.stop_keepalive()
        self.connections.discard(self)
        self.transport = _DETACHED_TRANSPORT
        return WebSocketConnection(transport, listener, cast(set[object], self.connections), clock)


def detach(socket: WebSocket, listener: ConnectionListener, clock: Callable[[], int] = clock) -> WebSocketConnection:
    """Take over an accepted WebSocket. The caller must not await anything between accepting it and this call.

    Raises `WebSocketDisconnect` if the client has disconnected, RuntimeError if the server does not use
    `HandoffProtocol`.
    """
    extension = (socket.scope.get("extensions") or {}).get(HANDOFF_EXTENSION)
    if extension is None:
        raise RuntimeError("run uvicorn with the options of bunraku.serve.uvicorn_protocol_options()")
    connection: WebSocketConnection | None = extension["take"](listener, clock)
    if connection is None:
        raise WebSocketDisconnect(1006)
    return connection
