from __future__ import annotations

import asyncio
from typing import Any

from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.websocket.subprotocol import TRY_AGAIN_LATER, CloseConnection


class FakeTransport(asyncio.Transport):
    """Transport that records written bytes."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self.is_closed = False

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None: ...

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...

    def write(self, data: Any) -> None:
        self.written += bytes(data)

    def is_closing(self) -> bool:
        return self.is_closed

    def close(self) -> None:
        self.is_closed = True

    def abort(self) -> None:
        self.is_closed = True


class RecordingListener:
    """Listener that records its events."""

    def __init__(self) -> None:
        self.events: list[str] = []

    def on_message(self, message: bytes) -> None:
        self.events.append(f"message {message.decode()}")

    def on_pong(self, payload: bytes) -> None:
        self.events.append(f"pong {payload.decode()}")

    def on_pause(self) -> None:
        self.events.append("pause")

    def on_resume(self) -> None:
        self.events.append("resume")

    def on_close(self) -> None:
        self.events.append("close")


def client_frame(opcode: Opcode, payload: bytes = b"") -> bytes:
    return bytes((0x80 | opcode, 0x80 | len(payload))) + bytes(4) + payload


async def test_received_data_updates_the_time_of_the_clock() -> None:
    now = 5_000_000
    listener = RecordingListener()
    connection = WebSocketConnection(FakeTransport(), listener, set(), lambda: now)
    assert connection.last_received_at == 5_000_000
    now = 7_000_000
    connection.data_received(client_frame(Opcode.BINARY, b"hello"))
    assert connection.last_received_at == 7_000_000
    connection.data_received(client_frame(Opcode.PONG))
    connection.data_received(client_frame(Opcode.PONG, b"payload"))
    assert listener.events == ["message hello", "pong payload"]


async def test_connection_that_is_closing_writes_and_delivers_nothing() -> None:
    transport, listener, connections = FakeTransport(), RecordingListener(), set[object]()
    connection = WebSocketConnection(transport, listener, connections)
    assert connections == {connection}
    connection.close_with_problem(CloseConnection(TRY_AGAIN_LATER, "Too slow", "try again later"))
    assert connection.is_closing
    written = transport.written
    assert b"Too slow" in written
    connection.close_with_problem(CloseConnection(TRY_AGAIN_LATER, "Again", "not sent"))
    connection.send_ping()
    connection.data_received(client_frame(Opcode.PING) + client_frame(Opcode.BINARY, b"late"))
    connection.resume_writing()
    assert transport.written == written
    # the client's Close frame ends the connection
    connection.data_received(client_frame(Opcode.CLOSE))
    assert transport.is_closed
    connection.connection_lost(None)
    assert listener.events == ["pause", "close"]
    assert not connections
