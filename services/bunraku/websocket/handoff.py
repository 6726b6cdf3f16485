"""Hand-off of an accepted WebSocket from ASGI to the application.

`HandoffProtocol` offers an ASGI extension with which an application takes over the connection. From then on the
application writes to the transport and receives its data directly.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any, cast

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from bunraku.runtime.client_network import client_network, peer_network
from bunraku.runtime.clock import clock
from bunraku.runtime.input_scheduler import InputScheduler
from bunraku.websocket import link, subprotocol
from bunraku.websocket.connection import (
    NO_LISTENER,
    VIEWER_FRAMES,
    ConnectionListener,
    FrameLimit,
    WebSocketConnection,
)
from bunraku.websocket.subprotocol import CloseConnection

HANDOFF_EXTENSION = "bunraku.take"
HANDSHAKE_TIMEOUT_S = 30.0
"""Time from the request to the response of a handshake, of which most is for backends."""
REJECTED_FRAMES = FrameLimit(1.0, 16.0)
"""Limit of a rejected client, of which only a Close frame is expected."""
_BAD_REQUEST = b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"


class _DetachedTransport(asyncio.Transport):
    """Inert transport for uvicorn's protocol after the hand-off."""

    def close(self) -> None:
        pass

    def is_closing(self) -> bool:
        return True


_DETACHED_TRANSPORT = _DetachedTransport()


class HandoffProtocol(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket protocol with the hand-off extension.

    It reads nothing from the client: every accepted connection is handed over, and a rejected one is closed. It uses
    attributes of the base class that uvicorn does not document; `pyproject.toml` bounds its version, and
    `tests/test_library_interfaces.py` checks them.
    """

    def __init__(self, scheduler: InputScheduler, *args: Any, **options: Any) -> None:
        """`scheduler` gives turns to the frames of all accepted connections."""
        super().__init__(*args, **options)
        self._scheduler = scheduler
        self._handshake_timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # the base class adds the connection to those of the server, which may abort it
        self.transport, self.source = cast(asyncio.Transport, transport), peer_network(transport)
        super().connection_made(transport)
        self.transport.pause_reading()
        self._handshake_timer = self.loop.call_later(HANDSHAKE_TIMEOUT_S, self.transport.abort)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if not self.handshake_initiated:
            # the only data is the request, which the parser has rejected without an answer
            self.transport.write(_BAD_REQUEST)
            self.transport.close()

    def abort(self) -> None:
        """End the connection at once."""
        self.transport.abort()

    def handle_parser_exception(self) -> None:
        pass

    def connection_lost(self, exc: Exception | None) -> None:
        self._cancel_timeout()
        self._withdraw_extension()
        super().connection_lost(exc)
        self._end_parser()

    def handle_connect(self, event: Request) -> None:
        # the application's task starts after this call, so it sees the extensions
        super().handle_connect(event)
        if not self.close_sent:
            extensions = self.scope["extensions"]
            assert extensions is not None
            extensions[HANDOFF_EXTENSION] = {"take": self.detach}
            extensions[link.LINK_EXTENSION] = {"transport": self.transport}

    async def send(self, message: Any) -> None:
        await super().send(message)
        if self.close_sent:
            # an HTTP response completes the handshake, too: otherwise each rejected client is logged as an error
            self.handshake_complete = True

    def detach(
        self, listener: ConnectionListener, clock: Callable[[], int], limit: FrameLimit
    ) -> WebSocketConnection | None:
        """Return the accepted connection, None if it has ended."""
        transport = self.transport
        if not self.handshake_complete or self.close_sent or self.disconnected or transport.is_closing():
            return None
        self._cancel_timeout()
        self._withdraw_extension()
        self._end_parser()
        self.stop_keepalive()
        self.connections.discard(self)
        self.transport = _DETACHED_TRANSPORT
        connections, client = cast(set[object], self.connections), self.scope["client"]
        source = client_network(client[0]) if client else None
        connection = WebSocketConnection(
            transport, listener, connections, clock, limit, scheduler=self._scheduler, source=source
        )
        transport.resume_reading()
        return connection

    def _withdraw_extension(self) -> None:
        """Remove the reference from the scope to this object, so that both are freed at once."""
        # a rejected handshake has no scope
        extensions = getattr(self, "scope", {}).get("extensions")
        if extensions is not None:
            extensions.pop(HANDOFF_EXTENSION, None)

    def _end_parser(self) -> None:
        """End the parser of the handshake, which refers to its own protocol, so that both are freed at once."""
        self.conn.parser.close()

    def _cancel_timeout(self) -> None:
        if self._handshake_timer is not None:
            self._handshake_timer.cancel()
            self._handshake_timer = None


def detach(
    socket: WebSocket,
    listener: ConnectionListener,
    clock: Callable[[], int] = clock,
    limit: FrameLimit = VIEWER_FRAMES,
) -> WebSocketConnection:
    """Take over an accepted WebSocket. The caller must not await anything between accepting it and this call.

    Raises `WebSocketDisconnect` if the client has disconnected, RuntimeError if the server does not use
    `HandoffProtocol`.
    """
    extension = (socket.scope.get("extensions") or {}).get(HANDOFF_EXTENSION)
    if extension is None:
        raise RuntimeError("run uvicorn with the options of bunraku.serve.uvicorn_protocol_options()")
    connection: WebSocketConnection | None = extension["take"](listener, clock, limit)
    if connection is None:
        raise WebSocketDisconnect(1006)
    return connection


async def reject(socket: WebSocket, reason: CloseConnection) -> None:
    """Send a Problem message and close the connection. Accept it first if necessary.

    Does nothing if the client has already disconnected.
    """
    with contextlib.suppress(WebSocketDisconnect):
        if socket.application_state is WebSocketState.CONNECTING:
            try:
                await subprotocol.accept(socket)
            except CloseConnection as unsupported:
                reason = unsupported
        detach(socket, NO_LISTENER, limit=REJECTED_FRAMES).close_with_problem(reason)
