"""Transport for tests that keeps the written data and can be made unwritable."""

from __future__ import annotations

import asyncio
from typing import Any

from bunraku.websocket.connection import ConnectionListener, WebSocketConnection
from bunraku.wire.messages import Message, unpack


class FakeTransport(asyncio.Transport):
    """Transport with `sent` and `unsent` data; while it has no capacity, writes stay unsent."""

    def __init__(self) -> None:
        super().__init__()
        self.protocol: Any = None
        self.has_capacity = True
        self.sent = b""
        self.unsent = b""
        self.writes = 0
        self.closing = self.aborted = False

    def open_connection(self, listener: ConnectionListener) -> WebSocketConnection:
        return WebSocketConnection(self, listener, set())

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self.protocol = protocol

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        assert (high, low) == (0, 0)

    def get_write_buffer_size(self) -> int:
        return len(self.unsent)

    def write(self, data: bytes | bytearray | memoryview[Any]) -> None:
        self.writes += 1
        if self.has_capacity:
            self.sent += bytes(data)
            return
        first = not self.unsent
        self.unsent += bytes(data)
        if first:
            self.protocol.pause_writing()

    def get_protocol(self) -> asyncio.BaseProtocol:
        protocol: asyncio.BaseProtocol = self.protocol
        return protocol

    def pause_reading(self) -> None: ...

    def resume_reading(self) -> None: ...

    def drain(self) -> None:
        """Restore the capacity and send the unsent data."""
        self.has_capacity = True
        self.sent, self.unsent = self.sent + self.unsent, b""
        self.protocol.resume_writing()

    def is_closing(self) -> bool:
        return self.closing

    def close(self) -> None:
        self.closing = True

    def abort(self) -> None:
        self.closing = self.aborted = True

    @property
    def messages(self) -> list[Message | None]:
        """Messages that were sent."""
        return [unpack(payload) for opcode, payload in parse_frames(self.sent) if opcode == 2]


def parse_frames(data: bytes) -> list[tuple[int, bytes]]:
    """Return opcode and payload of each frame of a server."""
    found, at = [], 0
    while at < len(data):
        size, body = data[at + 1], at + 2
        if size == 126:
            size, body = int.from_bytes(data[body : body + 2], "big"), body + 2
        elif size == 127:
            size, body = int.from_bytes(data[body : body + 8], "big"), body + 8
        found.append((data[at] & 15, data[body : body + size]))
        at = body + size
    return found
