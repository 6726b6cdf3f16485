"""Fuzzing target: the input socket of a live performer, from received bytes to the poses of the stage.

An input is a sequence of messages. The first byte of each selects what the socket receives: a text frame, a binary
frame, or the other bytes as they are. The connection, the parser of frames and the stage's performance are the real
ones; the transport, the store and the clock are of the test.
"""

from __future__ import annotations

import asyncio
import json
import weakref
from typing import Any

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from bunraku.playout.block_store import Pose
from bunraku.playout.performance import Performance, pack_sample, sample_pose
from bunraku.runtime.input_scheduler import TURN_US, InputScheduler
from bunraku.session.live.performer_connection import PERFORMER_FRAMES, PerformerConnection
from bunraku.storage.performance_store import PerformanceHeader, PerformanceStore
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.wire.live import MAX_ROOT_M, Sample
from bunraku.wire.messages import Ping, Pong, Problem, unpack
from tests.fuzz.datagram_sequence import join_datagrams, split_datagrams
from tests.raw_client import client_frame
from tests.stream.fake_transport import FakeTransport, parse_frames

BEGIN_US = 10**15
INTERVAL_US = 16_667
"""Time between two messages."""
MAX_ANSWER_RATIO = 4
"""Bound of what is sent by what was received: a Ping message of 13 bytes is answered with 31, a frame by itself."""
MAX_CLOSE_BYTES = 1_500
"""Bound of a Problem message and a Close frame."""

HEADER = PerformanceHeader("session-1", "Aiko", 60.0, standard_figure(), BEGIN_US)
LOOP = asyncio.new_event_loop()


class _Store(PerformanceStore):
    """Store in memory."""

    def __init__(self) -> None:
        self.stored = b""

    async def put_part(self, performer: str, name: str, samples: bytes) -> None:
        assert (performer, name.rpartition("-")[2].isdigit()) == (HEADER.id, True)
        self.stored += samples


class _Stage:
    """Stage that checks the samples and applies them to a performance, as that of a session does."""

    def __init__(self) -> None:
        self.now = BEGIN_US
        self.sent: list[bytes] = []
        self.performance = Performance(HEADER.figure, HEADER.fps)

    def send_sample(self, performer: str, connection: str, message: bytes | None) -> None:
        assert performer == HEADER.id
        assert connection
        if not message:
            return
        sample = unpack(message)
        assert isinstance(sample, Sample)
        pose = sample_pose(sample)
        check_pose(pose)
        self.performance.add(sample.sampled, pose, self.now)
        self.sent.append(message)

    def check_shown_poses(self) -> None:
        """Assert that the last poses that viewers get are poses, too."""
        newest = self.performance.newest_us
        if newest is not None:
            for capture in (newest - INTERVAL_US, newest):
                check_pose(self.performance.pose_at(capture))


def check_pose(pose: Pose) -> None:
    """Assert that a pose is finite and bounded; comparisons with NaN are false."""
    root, rotations = pose
    assert (np.abs(root) <= MAX_ROOT_M).all()
    assert (np.abs(np.linalg.norm(rotations, axis=-1) - 1.0) < 1e-9).all()


def performer_input(data: bytes) -> bool:
    """Receive the messages of an input; return whether a sample reached the stage."""
    return LOOP.run_until_complete(_receive(data))


async def _receive(data: bytes) -> bool:
    errors: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context))
    stage, store, transport = _Stage(), _Store(), FakeTransport()
    connection = PerformerConnection(stage, HEADER, store, lambda: stage.now)
    scheduler = InputScheduler(TURN_US, lambda: stage.now)
    socket = WebSocketConnection(
        transport, connection, set(), lambda: stage.now, PERFORMER_FRAMES, scheduler=scheduler, source="performer"
    )
    connection.open(socket)
    storing = asyncio.create_task(connection.store_samples())
    received = 0
    for message in split_datagrams(data):
        if len(message) < 2 or transport.get_protocol() is not socket:
            continue
        kind, payload = message[0] % 3, message[1:]
        chunk = payload if kind == 2 else client_frame((Opcode.TEXT, Opcode.BINARY)[kind], payload)
        received += len(chunk)
        stage.now += INTERVAL_US
        socket.data_received(chunk)
        while scheduler.is_busy:  # noqa: ASYNC110
            await asyncio.sleep(0)
    # a failure that the scheduler has caught
    assert not transport.aborted
    _check_answers(transport, socket, MAX_ANSWER_RATIO * received + MAX_CLOSE_BYTES)
    transport.protocol.connection_lost(None)
    await storing
    assert not errors, errors
    _check_stored(store.stored, stage.sent)
    stage.check_shown_poses()
    freed = weakref.ref(connection)
    del connection, socket, transport, storing
    assert freed() is None
    return bool(stage.sent)


def _check_answers(transport: FakeTransport, socket: WebSocketConnection, max_bytes: int) -> None:
    """Assert that only Pongs and the reason of the end were sent."""
    assert len(transport.sent) <= max_bytes
    assert all(isinstance(message, Pong | Problem) for message in transport.messages)
    closes = [payload for opcode, payload in parse_frames(transport.sent) if opcode == Opcode.CLOSE]
    assert len(closes) == socket.is_closing


def _check_stored(stored: bytes, sent: list[bytes]) -> None:
    """Assert that the stored samples are of those that the stage has received, in their order."""
    size = Sample.LAYOUT.size
    assert len(stored) % size == 0
    received = iter(sent)
    assert all(stored[at : at + size] in received for at in range(0, len(stored), size))


def load_seeds() -> list[bytes]:
    """Return valid inputs."""
    turns = rotation.from_rotation_vector(np.linspace(-3.0, 3.0, 3 * JOINT_COUNT).reshape(JOINT_COUNT, 3))
    root = np.array([0.5, 0.9, -0.5])
    samples = [pack_sample(BEGIN_US + k * INTERVAL_US, (root, turns), k).pack() for k in (1, 2, 3)]
    poses = [
        {"root": root.tolist(), "rotations": {"l_shoulder": [1, 0, 0, 0.5], "skullbase": [0.1, -2e-1, 3, 0]}},
        {"time": BEGIN_US, "root": [0, 0.9, 0]},
    ]
    texts = [json.dumps(pose).encode() for pose in poses]
    ping = Ping(3, BEGIN_US).pack()
    fragment = client_frame(Opcode.BINARY, samples[0][:70], final=False)
    last_fragment = client_frame(Opcode.CONTINUATION, samples[0][70:])
    return [
        join_datagrams(*(b"\1" + sample for sample in samples)),
        join_datagrams(*(b"\0" + text for text in texts)),
        join_datagrams(b"\1" + ping, b"\0" + texts[0], b"\1" + samples[1]),
        join_datagrams(b"\2" + fragment + client_frame(Opcode.PING, b"p"), b"\2" + last_fragment),
        join_datagrams(b"\2" + client_frame(Opcode.TEXT, texts[1]) + client_frame(Opcode.CLOSE, b"\3\xe8end")),
    ]
