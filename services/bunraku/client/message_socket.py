"""Minimal WebSocket client on an asyncio protocol: no task and no queue per connection, so that thousands fit in one
process. Framing and handshake are those of the sans-I/O layer of `websockets`.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import cast
from urllib.parse import urlsplit

from websockets.client import ClientProtocol
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from bunraku.wire.messages import MAX_SERVER_MESSAGE_BYTES, SUBPROTOCOL


class MessageSocket(asyncio.Protocol, ABC):
    """WebSocket at a `ws:` or `wss:` URL that passes each binary message to `on_message`."""

    __slots__ = ("_handshake", "_headers", "_protocol", "_transport", "url")

    def __init__(self, url: str, headers: Mapping[str, str] | None = None) -> None:
        """Prepare a connection; `headers` are added to its request."""
        self.url = url
        self._headers = headers or {}
        self._protocol = ClientProtocol(
            parse_uri(url), subprotocols=[Subprotocol(SUBPROTOCOL)], max_size=MAX_SERVER_MESSAGE_BYTES
        )
        self._handshake: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    @property
    def closed(self) -> bool:
        """True if the connection is closing or closed."""
        return self._protocol.state in (State.CLOSING, State.CLOSED)

    async def open(self) -> None:
        """Connect and complete the handshake. Raises OSError; ConnectionError if the server rejects the handshake."""
        parts = urlsplit(self.url)
        secure = parts.scheme == "wss"
        await asyncio.get_running_loop().create_connection(
            lambda: self, parts.hostname or "", parts.port or (443 if secure else 80), ssl=secure or None
        )
        await self._handshake

    @abstractmethod
    def on_message(self, message: bytes) -> None:
        """Handle a binary message of at least one byte."""

    def send(self, *messages: bytes) -> None:
        """Send binary messages, unless the connection is closed."""
        if self._protocol.state is State.OPEN and not self._transport.is_closing():
            for message in messages:
                self._protocol.send_binary(message)
            self._flush()

    def close(self) -> None:
        """Send a close frame and close the connection without waiting for the answer."""
        if not self._transport.is_closing():
            if self._protocol.state is State.OPEN:
                self._protocol.send_close(CloseCode.GOING_AWAY)
            self._flush()
            self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        request = self._protocol.connect()
        for name, value in self._headers.items():
            request.headers[name] = value
        self._protocol.send_request(request)
        self._flush()

    def data_received(self, data: bytes) -> None:
        self._protocol.receive_data(data)
        for event in self._protocol.events_received():
            if isinstance(event, Frame):
                if event.opcode is Opcode.BINARY and event.data:
                    self.on_message(bytes(event.data))
            elif isinstance(event, Response) and not self._handshake.done():
                if (error := self._protocol.handshake_exc) is None:
                    self._handshake.set_result(None)
                else:
                    self._handshake.set_exception(ConnectionError(str(error)))
        self._flush()
        if self._protocol.close_expected():
            self._transport.close()

    def connection_lost(self, error: Exception | None) -> None:
        self._protocol.receive_eof()
        if not self._handshake.done():
            self._handshake.set_exception(error or ConnectionError("the server closed the connection"))

    def _flush(self) -> None:
        for data in self._protocol.data_to_send():
            if data:
                self._transport.write(data)
