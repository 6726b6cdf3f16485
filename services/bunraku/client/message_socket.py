"""A WebSocket (RFC 6455) that takes in messages and does nothing else of its own, so that thousands fit in a process.

It speaks to our servers alone: they send messages whole, unmasked and unpacked.
"""

from __future__ import annotations

import asyncio
import base64
import secrets
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import cast
from urllib.parse import urlsplit

from bunraku.wire.messages import SUBPROTOCOL

_BINARY, _CLOSE, _PING, _PONG = 0x2, 0x8, 0x9, 0xA
"""Opcodes: of a binary message, and of what both sides' sockets say to each other."""
_FIN = 0x80
"""Beside an opcode: nothing of it follows."""


def upgrade_request(url: str, headers: Mapping[str, str] | None = None) -> bytes:
    """The request that opens a socket at a `ws:` or `wss:` URL, with what `headers` it has beside its own."""
    parts = urlsplit(url)
    target = parts.path + (f"?{parts.query}" if parts.query else "")
    key = base64.b64encode(secrets.token_bytes(16)).decode()
    lines = (
        f"GET {target} HTTP/1.1", f"Host: {parts.netloc}", "Upgrade: websocket", "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: {SUBPROTOCOL}",
        *(f"{name}: {value}" for name, value in (headers or {}).items()), "", "",
    )  # fmt: skip
    return "\r\n".join(lines).encode()


class MessageSocket(asyncio.Protocol, ABC):
    """One socket, from its connection on; what comes goes to `take`, which is there to be given in a subclass."""

    __slots__ = ("_buffer", "_handshake", "_headers", "_transport", "closed", "url")

    def __init__(self, url: str, headers: Mapping[str, str] | None = None) -> None:
        """At a `ws:` or `wss:` URL, with what `headers` its request has beside its own."""
        self.url = url
        self.closed = False
        self._headers = headers
        self._buffer = b""
        self._handshake: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    async def open(self) -> None:
        """Connect; returns when the server has agreed to talk. Raises OSError, of which ConnectionError says its no."""
        parts = urlsplit(self.url)
        secure = parts.scheme == "wss"
        await asyncio.get_running_loop().create_connection(
            lambda: self, parts.hostname or "", parts.port or (443 if secure else 80), ssl=secure or None
        )
        await self._handshake

    @abstractmethod
    def on_message(self, message: bytes) -> None:
        """A binary message has come, of one byte at least."""

    def send(self, *messages: bytes) -> None:
        """Send binary messages of less than 126 bytes, unless the socket is closed."""
        if not self.closed and not self._transport.is_closing():
            self._transport.write(b"".join(_client_frame(_BINARY, message) for message in messages))

    def close(self) -> None:
        """Go."""
        if not self._transport.is_closing():
            self._transport.write(_client_frame(_CLOSE, (1001).to_bytes(2, "big")))
            self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """As asyncio has it."""
        self._transport = cast(asyncio.Transport, transport)
        self._transport.write(upgrade_request(self.url, self._headers))

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        if self._buffer:
            data, self._buffer = self._buffer + data, b""
        at, end = 0, len(data)
        if not self._handshake.done():
            head, found, _ = data.partition(b"\r\n\r\n")
            if not found:
                self._buffer = data
                return
            first = head.split(b"\r\n", 1)[0]
            if b" 101 " not in first + b" ":
                self._handshake.set_exception(ConnectionError(f"the server answered {first.decode(errors='replace')}"))
                self._transport.close()
                return
            self._handshake.set_result(None)
            at = len(head) + 4
        while end - at >= 2:
            size, body = data[at + 1], at + 2
            if size >= 126:
                wide = 2 if size == 126 else 8
                size, body = int.from_bytes(data[body : body + wide], "big"), body + wide
            if body + size > end:
                break
            if data[at] == _FIN | _BINARY and size:
                self.on_message(data[body : body + size])
            elif data[at] == _FIN | _PING:
                self._transport.write(_client_frame(_PONG, data[body : body + size]))
            elif data[at] == _FIN | _CLOSE and not self.closed:
                self.closed = True
                self.close()
            at = body + size
        self._buffer = data[at:]

    def connection_lost(self, error: Exception | None) -> None:
        """As asyncio has it."""
        self.closed = True
        if not self._handshake.done():
            self._handshake.set_exception(error or ConnectionError("the server closed the connection"))


def _client_frame(opcode: int, payload: bytes) -> bytes:
    """A client's frame of less than 126 bytes (RFC 6455, section 5.2); its mask is zero."""
    return bytes((_FIN | opcode, 0x80 | len(payload), 0, 0, 0, 0)) + payload
