from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from bunraku.playout.performance import pack_sample
from bunraku.session.live.performer_connection import (
    MAX_AGE_US,
    MAX_AHEAD_US,
    PERFORMER_FRAMES,
    SAMPLE_BURST,
    PerformerConnection,
)
from bunraku.storage.motion_store import MotionStore
from bunraku.storage.performance_store import MAX_DURATION_US, PerformanceHeader
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.wire.live import Sample
from bunraku.wire.messages import Input, Ping, Pong, Problem
from tests.raw_client import client_frame
from tests.stream.fake_transport import FakeTransport
from tests.time_limit import HANG_TIMEOUT_S

HEADER = PerformanceHeader("session-1", "Aiko", 60.0, standard_figure(), 10**15)
REST = np.array([0.0, 0.9, 0.0]), np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


class RecordingStage:
    """Stage that records what a connection sends."""

    def __init__(self) -> None:
        self.received: list[bytes | None] = []
        self.has_left = asyncio.Event()

    def send_sample(self, performer: str, _: str, message: bytes | None) -> None:
        assert performer == HEADER.id
        self.received.append(message)
        if message is None:
            self.has_left.set()

    @property
    def samples(self) -> list[Sample]:
        return [Sample.unpack(message) for message in self.received if message]


class Performer:
    """A performer's connection with a virtual clock."""

    def __init__(self, folder: Path) -> None:
        self.now = 10**15
        self.stage, self.transport = RecordingStage(), FakeTransport()
        self.store = MotionStore.open(folder.as_uri()).performances
        self.connection = PerformerConnection(self.stage, HEADER, self.store, lambda: self.now)
        self.socket = WebSocketConnection(self.transport, self.connection, set(), lambda: self.now, PERFORMER_FRAMES)
        self.connection.open(self.socket)
        self.storing = asyncio.create_task(self.connection.store_samples())

    def receive(self, message: Any) -> None:
        self.socket.data_received(client_frame(Opcode.BINARY, message.pack()))

    def receive_text(self, text: str) -> None:
        self.socket.data_received(client_frame(Opcode.TEXT, text.encode()))

    async def leave(self) -> list[Sample]:
        """End the connection; return the stored samples."""
        self.socket.connection_lost(None)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await self.stage.has_left.wait()
        found = await self.store.list_performances()
        if HEADER.id not in found:
            return []
        data = b"".join(await self.store.load(HEADER.id, found[HEADER.id]))
        size = Sample.LAYOUT.size
        return [Sample.unpack(data[at : at + size]) for at in range(0, len(data), size)]

    def problems(self) -> list[str]:
        return [message.title for message in self.transport.messages if isinstance(message, Problem)]


@pytest.fixture
async def performer(tmp_path: Path) -> AsyncIterator[Performer]:
    opened = Performer(tmp_path)
    yield opened
    await opened.leave()


async def test_samples_reach_the_stage_and_the_store(performer: Performer) -> None:
    samples = [pack_sample(performer.now - 1000 * k, REST, k) for k in range(5)]
    for sample in samples:
        performer.receive(sample)
    performer.receive_text(json.dumps({"root": [0, 0.9, 0]}))
    assert performer.stage.received[0] == b""
    assert performer.stage.samples == [*samples, pack_sample(performer.now, REST)]
    assert await performer.leave() == performer.stage.samples
    assert performer.stage.received[-1] is None


async def test_sample_of_another_time_is_not_stored(performer: Performer) -> None:
    times = [performer.now - MAX_AGE_US - 1, performer.now, performer.now + MAX_AHEAD_US + 1]
    for time in times:
        performer.receive(pack_sample(time, REST))
    assert [sample.sampled for sample in performer.stage.samples] == times
    assert [sample.sampled for sample in await performer.leave()] == [performer.now]


async def test_samples_beyond_the_longest_motion_are_shown_but_not_stored(performer: Performer) -> None:
    for performer.now in (HEADER.created_us + MAX_DURATION_US, HEADER.created_us + MAX_DURATION_US + 1):
        performer.receive(pack_sample(performer.now, REST))
    assert len(performer.stage.samples) == 2
    assert [sample.sampled for sample in await performer.leave()] == [HEADER.created_us + MAX_DURATION_US]


async def test_ping_is_answered_and_other_messages_are_ignored(performer: Performer) -> None:
    performer.receive(Ping(3, 4))
    performer.receive(Input(0, Input.TARGET, 1, 1, 0, (0.0, 0.0, 0.0)))
    assert performer.transport.messages == [Pong(3, 4, performer.now, performer.now)]
    assert performer.stage.samples == []


async def test_samples_above_the_rate_are_dropped_and_a_flood_is_disconnected(performer: Performer) -> None:
    for _ in range(int(SAMPLE_BURST) + 20):
        performer.receive(pack_sample(performer.now, REST))
    assert len(performer.stage.samples) == SAMPLE_BURST
    assert performer.problems() == []
    for _ in range(int(PERFORMER_FRAMES.burst)):
        performer.receive(pack_sample(performer.now, REST))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not performer.socket.is_closing:  # noqa: ASYNC110
            await asyncio.sleep(0)
    assert performer.problems() == ["Too many messages"]


@pytest.mark.parametrize("text", ["", "hello", "{}", '{"root": [0, 1, 0], "more": 1}'])
async def test_malformed_text_closes_the_connection_with_a_reason(performer: Performer, text: str) -> None:
    performer.receive_text(text)
    assert performer.socket.is_closing
    assert performer.problems() == ["Malformed sample"]


async def test_connection_is_closed_when_another_is_current_or_the_performance_has_ended(performer: Performer) -> None:
    performer.connection.receive_told(performer.connection.id.encode())
    assert performer.problems() == []
    performer.connection.receive_told(b"another")
    assert performer.problems() == ["Replaced"]


async def test_ended_performance_closes_the_connection(performer: Performer) -> None:
    performer.connection.receive_told(b"")
    assert performer.problems() == ["Performance ended"]
