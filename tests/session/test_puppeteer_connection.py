from __future__ import annotations

import asyncio
from typing import Any

import pytest

from bunraku.session.counters import RATE_LIMITED, SessionCounters
from bunraku.session.notice_throttle import MAX_MESSAGES_PER_S
from bunraku.session.puppeteer_connection import MAX_QUEUED_MESSAGES, PUPPETEER_FRAMES, PuppeteerConnection
from bunraku.websocket.connection import FRAMES_PER_TURN, WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.websocket.heartbeat import HEARTBEAT_TIMEOUT_US
from bunraku.websocket.subprotocol import CloseConnection
from bunraku.wire.messages import Alive, Input, Notice, Ping, Pong, Problem
from tests.raw_client import client_frame
from tests.stream.fake_transport import FakeTransport


class RecordingStage:
    """Stage that records what a puppeteer sends."""

    def __init__(self) -> None:
        self.received: list[bytes | None] = []

    def send(self, _: PuppeteerConnection, message: bytes | None) -> None:
        self.received.append(message)


class Puppet:
    """A puppeteer's connection with a virtual clock."""

    def __init__(self) -> None:
        self.now = 10**15
        self.stage, self.counters, self.transport = RecordingStage(), SessionCounters(), FakeTransport()
        self.connection = PuppeteerConnection(self.stage, self.counters, lambda: self.now)
        self.socket: WebSocketConnection

    def open(self) -> None:
        self.socket = WebSocketConnection(self.transport, self.connection, set(), lambda: self.now, PUPPETEER_FRAMES)
        self.connection.open(self.socket)

    def receive(self, message: Any) -> None:
        self.socket.data_received(client_frame(Opcode.BINARY, message.pack()))

    def problems(self) -> list[str]:
        return [message.title for message in self.transport.messages if isinstance(message, Problem)]


INPUT = Input(2, Input.TARGET, 1, 1, 0, (0.0, 0.0, 0.0))


async def test_messages_of_the_stage_wait_until_the_connection_is_open() -> None:
    puppet = Puppet()
    puppet.connection.send(Pong(1, 2, 3, 4).pack())
    puppet.open()
    assert puppet.transport.messages == [Pong(1, 2, 3, 4)]
    puppet.connection.send(Pong(2, 2, 3, 4).pack())
    assert puppet.transport.messages[1:] == [Pong(2, 2, 3, 4)]
    # a heartbeat
    assert puppet.stage.received == [b""]


async def test_inputs_above_the_rate_are_dropped_with_a_notice() -> None:
    puppet = Puppet()
    puppet.open()
    for _ in range(MAX_MESSAGES_PER_S + 5):
        puppet.receive(INPUT)
    assert puppet.stage.received.count(INPUT.pack()) == MAX_MESSAGES_PER_S
    assert puppet.counters.inputs[RATE_LIMITED] == 5
    (notice,) = puppet.transport.messages
    assert isinstance(notice, Notice)
    assert (notice.limb, notice.reason) == (2, "rate")
    assert str(MAX_MESSAGES_PER_S) in notice.detail
    puppet.now += 1_000_000
    puppet.receive(INPUT)
    assert puppet.stage.received[-1] == INPUT.pack()
    # other messages are not dropped
    for _ in range(MAX_MESSAGES_PER_S):
        puppet.receive(Alive([0, 1]))
    assert puppet.stage.received.count(Alive([0, 1]).pack()) == MAX_MESSAGES_PER_S
    assert not puppet.socket.is_closing


@pytest.mark.parametrize("message", [INPUT, Alive([0, 1]), Ping(1, 2)])
async def test_flood_is_disconnected(message: Any) -> None:
    puppet = Puppet()
    puppet.open()
    frame = client_frame(Opcode.BINARY, message.pack())
    puppet.socket.data_received(frame * 20_000)
    for _ in range(20_000 // FRAMES_PER_TURN):
        await asyncio.sleep(0)
    assert puppet.problems() == ["Too many messages"]
    assert len(puppet.stage.received) <= PUPPETEER_FRAMES.burst + 1


async def test_output_to_a_client_that_does_not_read_is_bounded() -> None:
    puppet = Puppet()
    puppet.open()
    puppet.transport.has_capacity = False
    puppet.socket.write(b"\x89\x00")
    for _ in range(MAX_QUEUED_MESSAGES):
        puppet.connection.send(bytes(100))
    assert not puppet.socket.is_closing
    puppet.connection.send(bytes(100))
    assert puppet.socket.is_closing
    for _ in range(1_000):
        puppet.connection.send(bytes(100))
    assert len(puppet.transport.unsent) < 1_000


async def test_queued_messages_follow_when_the_client_reads_again() -> None:
    puppet = Puppet()
    puppet.open()
    puppet.transport.has_capacity = False
    puppet.socket.write(b"\x89\x00")
    for sequence in range(3):
        puppet.connection.send(Pong(sequence, 0, 0, 0).pack())
    puppet.transport.drain()
    assert [message.sequence for message in puppet.transport.messages if isinstance(message, Pong)] == [0, 1, 2]


async def test_unknown_puppeteer_is_asked_to_reconnect() -> None:
    for opens_first in (True, False):
        puppet = Puppet()
        if opens_first:
            puppet.open()
        puppet.connection.send(b"")
        if not opens_first:
            puppet.open()
        assert puppet.problems() == ["Session elsewhere"]


async def test_access_that_ends_closes_the_connection() -> None:
    puppet = Puppet()
    puppet.open()
    puppet.connection.close(CloseConnection(4401, "Link expired", "over"))
    assert puppet.problems() == ["Link expired"]


async def test_malformed_message_closes_the_connection() -> None:
    puppet = Puppet()
    puppet.open()
    puppet.socket.data_received(client_frame(Opcode.BINARY, bytes([67])))
    assert puppet.problems() == ["Malformed message"]


async def test_silent_client_is_aborted() -> None:
    puppet = Puppet()
    puppet.open()
    puppet.now += HEARTBEAT_TIMEOUT_US + 1
    puppet.connection._send_heartbeat()
    assert puppet.transport.aborted
    puppet.connection.on_close()
    await asyncio.sleep(0)
