"""How a WebSocket is taken out of ASGI's hands once it is accepted.

uvicorn's protocol offers applications, as an ASGI extension of its own, to take the connection: what the application
then writes goes to the transport, and what comes goes to the application, with nothing between.
"""

from __future__ import annotations

import asyncio
from typing import cast

from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from bunraku.websocket import link
from bunraku.websocket.connection import ConnectionListener, WebSocketConnection

HANDOFF_EXTENSION = "bunraku.take"


class _DetachedTransport(asyncio.Transport):
    """What is left to uvicorn of a connection that was taken: nothing that it does has an effect."""

    def close(self) -> None:
        """Nothing."""

    def is_closing(self) -> bool:
        """It is as if it were."""
        return True


_DETACHED_TRANSPORT = _DetachedTransport()


class HandoffProtocol(WebSocketsSansIOProtocol):
    """uvicorn's protocol, with the extension."""

    def handle_connect(self, event: Request) -> None:
        """As the base has it; the application's task starts after this."""
        super().handle_connect(event)
        if not self.close_sent:
            extensions = self.scope["extensions"]
            assert extensions is not None
            extensions[HANDOFF_EXTENSION] = {"take": self.detach}
            extensions[link.LINK_EXTENSION] = {"transport": self.transport}

    def detach(self, listener: ConnectionListener) -> WebSocketConnection | None:
        """The connection, accepted and not read from since; None where it has ended meanwhile."""
        transport = self.transport
        if not self.handshake_complete or self.close_sent or self.disconnected or transport.is_closing():
            return None
        if not self.queue.empty() or self.conn.reader.buffer:
            raise RuntimeError("a connection is taken before anything is read from it")
        self.stop_keepalive()
        self.connections.discard(self)
        self.transport = _DETACHED_TRANSPORT
        return WebSocketConnection(transport, listener, cast(set[object], self.connections))


def detach(socket: WebSocket, listener: ConnectionListener) -> WebSocketConnection:
    """Take a socket that was accepted, with nothing awaited since; from here on the socket says no more.

    Raises `WebSocketDisconnect` where the client has gone, RuntimeError where the server is not ours.
    """
    offered = (socket.scope.get("extensions") or {}).get(HANDOFF_EXTENSION)
    if offered is None:
        raise RuntimeError("viewers need a server with uvicorn's options of bunraku.serve.protocol()")
    outlet: WebSocketConnection | None = offered["take"](listener)
    if outlet is None:
        raise WebSocketDisconnect(1006)
    return outlet
