from __future__ import annotations

import asyncio
from itertools import count, pairwise
from typing import Any

import pytest

from bunraku.runtime.input_scheduler import TURN_US
from bunraku.websocket.connection import FRAMES_PER_TURN, BinaryListener, FrameLimit, WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.websocket.subprotocol import POLICY_VIOLATION, TRY_AGAIN_LATER, CloseConnection
from tests.raw_client import client_frame


class FakeTransport(asyncio.Transport):
    """Transport that records written bytes."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self.is_closed = False
        self.reads = True
        self.protocol: Any = None

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self.protocol = protocol

    def get_protocol(self) -> asyncio.BaseProtocol:
        protocol: asyncio.BaseProtocol = self.protocol
        return protocol

    def pause_reading(self) -> None:
        self.reads = False

    def resume_reading(self) -> None:
        self.reads = True

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...

    def write(self, data: Any) -> None:
        self.written += bytes(data)

    def is_closing(self) -> bool:
        return self.is_closed

    def close(self) -> None:
        self.is_closed = True

    def abort(self) -> None:
        self.is_closed = True


class RecordingListener(BinaryListener):
    """Listener that records its events."""

    def __init__(self) -> None:
        self.events: list[str] = []

    def on_message(self, message: bytes) -> None:
        self.events.append(f"message {message.decode()}")

    def on_pong(self, payload: bytes) -> bool:
        self.events.append(f"pong {payload.decode()}")
        return payload == b"payload"

    def on_pause(self) -> None:
        self.events.append("pause")

    def on_resume(self) -> None:
        self.events.append("resume")

    def on_close(self) -> None:
        self.events.append("close")


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
    # a clock that stands still: all input has its turn at once, however long the machine takes
    connection = WebSocketConnection(transport, listener, connections, lambda: 0)
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


FLOODS = {
    "pings": [client_frame(Opcode.PING, b"x")],
    "pongs": [client_frame(Opcode.PONG, b"x")],
    "empty messages": [client_frame(Opcode.BINARY)],
    "one byte of a frame without end": [b"\x82\xfe\x03\xe8" + bytes(4), b"x"],
    "empty fragments": [client_frame(Opcode.BINARY, final=False), client_frame(Opcode.CONTINUATION, final=False)],
    "segments of one byte": [b"\x82", b"\xfd"],
}


@pytest.mark.parametrize("name", FLOODS)
async def test_flood_is_closed_with_the_reason_and_not_parsed_further(name: str) -> None:
    transport, listener = FakeTransport(), RecordingListener()
    limit = FrameLimit(10.0, 20.0)
    connection = WebSocketConnection(transport, listener, set(), lambda: 0, limit)
    first, *rest = FLOODS[name]
    connection.data_received(first)
    for _ in range(100):
        if transport.protocol is not connection:
            break
        connection.data_received(rest[0] if rest else first)
    assert connection.is_closing
    assert POLICY_VIOLATION.to_bytes(2, "big") in transport.written
    assert b"Too many messages" in transport.written
    # from now on input is discarded, and read slowly
    assert transport.protocol is not connection
    assert not transport.reads
    transport.protocol.data_received(first * 1_000)
    assert len(listener.events) <= limit.burst + 1
    transport.protocol.connection_lost(None)
    assert listener.events[-1] == "close"


async def test_flood_within_one_segment_gets_one_pong_at_most() -> None:
    transport = FakeTransport()
    connection = WebSocketConnection(transport, RecordingListener(), set(), lambda: 0, FrameLimit(0.0, 1_000.0))
    connection.data_received(client_frame(Opcode.PING, b"1") * 15 + client_frame(Opcode.PING, b"2"))
    assert transport.written == b"\x8a\x012"


async def test_other_connections_are_served_between_the_frames_of_one() -> None:
    transport, listener = FakeTransport(), RecordingListener()
    # each turn takes the time of an iteration
    clock = count(0, TURN_US).__next__
    connection = WebSocketConnection(transport, listener, set(), clock, FrameLimit(0.0, 1_000.0))
    connection.data_received(client_frame(Opcode.BINARY, b"m") * 100 + b"\x82")
    turns = [len(listener.events)]
    while len(listener.events) < 100:
        assert not transport.reads
        await asyncio.sleep(0)
        turns.append(len(listener.events))
    assert max(after - before for before, after in pairwise(turns)) == FRAMES_PER_TURN
    assert turns[0] == FRAMES_PER_TURN
    await asyncio.sleep(0)
    assert transport.reads
    # the frame that has begun continues
    connection.data_received(b"\x81" + bytes(4) + b"n")
    assert listener.events[-1] == "message n"


async def test_pongs_that_answer_do_not_count() -> None:
    transport = FakeTransport()
    connection = WebSocketConnection(transport, RecordingListener(), set(), lambda: 0, FrameLimit(0.0, 50.0))
    for _ in range(100):
        connection.data_received(client_frame(Opcode.PONG, b"payload"))
    assert not connection.is_closing
    for _ in range(100):
        connection.data_received(client_frame(Opcode.PONG, b"guess"))
    assert connection.is_closing


async def test_limit_refills_with_the_clock() -> None:
    now = 0
    transport, listener = FakeTransport(), RecordingListener()
    connection = WebSocketConnection(transport, listener, set(), lambda: now, FrameLimit(10.0, 5.0))
    for _ in range(100):
        connection.data_received(client_frame(Opcode.BINARY, b"m"))
        now += 100_000
    assert not connection.is_closing
    assert len(listener.events) == 100


async def test_rest_of_a_segment_is_parsed_after_a_closing_message() -> None:
    transport, listener = FakeTransport(), RecordingListener()
    connection = WebSocketConnection(transport, listener, set(), lambda: 0)
    connection.data_received(client_frame(Opcode.TEXT, b"hello") + client_frame(Opcode.CLOSE))
    assert connection.is_closing
    # the Close frame in the same segment has its turn and ends the connection, without further data
    await asyncio.sleep(0)
    assert transport.is_closed


@pytest.mark.parametrize(
    ("payload", "code"),
    [(b"", 1000), (b"\x03\xe9", 1001), (b"\x03\xe8\xff", 1007), (b"\x00\x01", 1002), (b"\x03", 1002)],
)
async def test_close_frame_is_answered_with_its_code(payload: bytes, code: int) -> None:
    transport = FakeTransport()
    connection = WebSocketConnection(transport, RecordingListener(), set(), lambda: 0)
    connection.data_received(client_frame(Opcode.CLOSE, payload))
    assert transport.written == b"\x88\x02" + code.to_bytes(2, "big")
    assert transport.is_closed
