"""Live performers on a server: shown to viewers, controlled by puppeteers, kept as motions."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect

from bunraku.client import Client, Performer, Puppeteer, ServerProblem, StreamEnded, Viewer
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, joint_and_tip_positions, standard_figure
from bunraku.playout.block_store import Pose
from bunraku.runtime.clock import clock
from bunraku.wire.messages import SUBPROTOCOL
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S


def pose_at(time_s: float) -> Pose:
    """Wave with both arms and walk in a circle."""
    vectors = np.zeros((JOINT_COUNT, 3))
    vectors[JOINT_INDEX["l_shoulder"], 2] = 0.8 + 0.5 * math.sin(3.0 * time_s)
    vectors[JOINT_INDEX["r_elbow"], 0] = -0.6 + 0.4 * math.cos(2.0 * time_s)
    vectors[0, 1] = 0.5 * math.sin(time_s)
    root = np.array([0.2 * math.sin(time_s), 0.82, 0.2 * math.cos(time_s)])
    return root, rotation.from_rotation_vector(vectors)


@asynccontextmanager
async def sending(performer: Performer, sent: dict[int, Pose] | None = None) -> AsyncIterator[None]:
    """Send poses at 60 Hz until the context ends; `sent` gets them by the capture time in microseconds."""

    async def send() -> None:
        while True:
            now = time.monotonic()
            await performer.frame(pose_at(now), now)
            if sent is not None:
                sent[round(performer.clock.at(round(now * 1e6)))] = pose_at(now)
            await asyncio.sleep(1 / 60)

    task = asyncio.create_task(send())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@asynccontextmanager
async def watching(client: Client, session: str) -> AsyncIterator[tuple[Viewer, dict[int, Pose]]]:
    """Watch a session; the poses of its first performer are collected by reference time."""
    seen: dict[int, Pose] = {}
    viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
    task = asyncio.create_task(viewer.watch(4 * HANG_TIMEOUT_S, seen.__setitem__))
    try:
        yield viewer, seen
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def wait_for_live(viewer: Viewer, messages: int) -> None:
    """Wait until a viewer has received so many further Live messages."""
    end = viewer.statistics.live_messages + messages
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while viewer.statistics.live_messages < end:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def wait_for_motion(client: Client, motion: str) -> dict[str, object]:
    """Wait until a motion is in the library, and return it."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            found = [one for one in await client.motions() if one["id"] == motion]
            if found:
                return found[0]
            await asyncio.sleep(0.05)


def angle(one: Array, other: Array) -> float:
    """Return the largest angle between the joint rotations of two poses, radians."""
    turn = rotation.multiply(rotation.conjugate(one), other)
    return float(np.linalg.norm(rotation.to_rotation_vector(turn), axis=-1).max())


async def test_performer_is_seen_and_controlled_and_becomes_a_motion(tmp_path: Path) -> None:
    sent: dict[int, Pose] = {}
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            async with client.perform(name="Aiko", fps=60) as performer:
                session = performer.session
                async with watching(client, session) as (viewer, seen), sending(performer, sent):
                    await wait_for_live(viewer, 60)
                    assert viewer.presence is not None
                    assert viewer.presence.live == [{"performer": 0, "id": performer.description["id"], "name": "Aiko"}]
                    assert (await performer.describe())["samples"]["applied"] > 50
                    assert (await client.session(session))["base"] is None
                    # one second of what is seen, compared with what was sent a moment before
                    shown = {at: pose for at, pose in seen.items() if at > max(seen) - 500_000}
                    lag = min(range(0, 400_000, 5_000), key=lambda lag: deviation(shown, sent, lag))
                    assert deviation(shown, sent, lag) < 0.05
                    async with Puppeteer(client, session, "Yuki") as yuki:
                        await yuki.claim("left_hand")
                        await yuki.target("left_hand", 0.3, 0.5, 0.6)
                        overlays = viewer.statistics.overlays
                        await wait_for_live(viewer, 60)
                        assert viewer.statistics.overlays > overlays
                        held, _ = pose_at(0.0), None
                        assert angle(seen[max(seen)][1][:1], held[1][:1]) < 2.0
                    recording = await client.record(session, "Together", 1.0)
                    assert recording["duration"] == pytest.approx(1.0, abs=0.05)
            stored = await wait_for_motion(client, performer.motion)
            assert stored["name"] == "Aiko"
            times = sorted(sent)
            assert stored["duration"] == pytest.approx((times[-1] - times[0]) * 1e-6, abs=0.05)
            poses = await decode(client, performer.motion)
    check_archive(poses, sent)


def deviation(shown: dict[int, Pose], sent: dict[int, Pose], lag: int) -> float:
    """Return the median of the largest joint angle between shown poses and those sent `lag` microseconds before."""
    times = np.array(sorted(sent))
    deviations = []
    for at, pose in shown.items():
        nearest = int(times[np.abs(times - (at - lag)).argmin()])
        deviations.append(angle(pose[1], sent[nearest][1]))
    return float(np.median(deviations))


async def decode(client: Client, motion: str) -> list[Pose]:
    """Return the poses of a stored motion at 60 Hz, at the best level."""
    viewer = Viewer(client.socket_url(f"/v1/motions/{motion}/stream"))
    task = asyncio.create_task(viewer.watch(4 * HANG_TIMEOUT_S))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            store = viewer._blocks
            if store is not None and all(store.level(index) >= 2 for index in range(store.track.block_count)):
                break
            await asyncio.sleep(0.02)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    poses = [store.pose_at(round(k * 1e6 / 60)) for k in range(store.track.frames)]
    return [pose for pose in poses if pose is not None]


def check_archive(poses: list[Pose], sent: dict[int, Pose]) -> None:
    """Compare an archived motion with the poses that were sent, as positions of joints and tips."""
    times = np.array(sorted(sent))
    grid = times[0] + np.round(np.arange(len(poses)) * 1e6 / 60)
    figure = standard_figure()
    positions = np.array([joint_and_tip_positions(figure, *sent[int(at)]) for at in times])
    flat = positions.reshape(len(times), -1)
    expected = np.stack([np.interp(grid, times, column) for column in flat.T], axis=-1).reshape(len(grid), -1, 3)
    archived = np.array([joint_and_tip_positions(figure, *pose) for pose in poses])
    errors = np.linalg.norm(archived - expected, axis=-1) * 1e3
    # where the sender was suspended for longer, the figure stands still
    assert np.median(errors) < 1.0
    assert np.median(errors[-1]) < 1.0


async def test_performer_joins_a_running_dance_and_leaves_it(tmp_path: Path, clip_file: Path) -> None:
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            dance = (await client.upload(clip_file))["id"]
            session = (await client.open_session(dance))["id"]
            async with watching(client, session) as (viewer, _):
                async with (
                    client.perform(name="Aiko", session=session) as aiko,
                    client.perform(name="Yuki", session=session, place=(0.0, 2.0, 3.1)) as yuki,
                ):
                    assert [aiko.description["performer"], yuki.description["performer"]] == [1, 2]
                    async with sending(aiko), sending(yuki):
                        await wait_for_live(viewer, 20)
                        assert len(viewer.performers) == 3
                    described = await client.session(session)
                    assert described["base"] == dance != described["motion"]
                    async with client.perform(session=session) as fourth:
                        assert fourth.description["performer"] == 3
                        with pytest.raises(ServerProblem) as full:
                            async with client.perform(session=session):
                                pass
                        assert full.value.status == 409
                    # another dance keeps its live performers
                    await client.edit_session(session, motion=(await client.upload(clip_file))["id"])
                    assert (await aiko.describe())["performer"] == 1
                described = await client.session(session)
                assert described["motion"] == described["base"] == dance
                assert len(described["limbs"]) == 4


async def test_second_connection_replaces_the_first_and_end_closes_it(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        async with Client(url) as client, client.perform() as performer:
            address = client.socket_url(performer.description["input"])
            async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as second:  # type: ignore[list-item]
                with pytest.raises(StreamEnded, match="Replaced"):  # noqa: PT012
                    async with asyncio.timeout(HANG_TIMEOUT_S):
                        while True:
                            await performer.frame(pose_at(0.0))
                            await asyncio.sleep(0.01)
                sample = {"root": [0, 0.8, 0], "rotations": {"l_shoulder": [1, 0, 0, 0.5]}}
                await second.send(json.dumps(sample))
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    while (await performer.describe())["samples"]["applied"] == 0:
                        await second.send(json.dumps(sample | {"time": clock()}))
                        await asyncio.sleep(0.01)
                await client.end_performer(performer.description["id"])
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    await second.wait_closed()
                assert second.close_code == 4404
            with pytest.raises(ServerProblem) as gone:
                await performer.describe()
            assert gone.value.status == 404


@pytest.mark.parametrize(
    "message",
    [
        '{"root": [0, 1, 0], "rotations": {"l_wing": [1, 0, 0, 0]}}',
        '{"root": [0, 1e9, 0]}',
        '{"root": [0, 1, 0], "rotations": {"vl5": [0, 0, 0, 0]}}',
        '{"root": [0, 1, 0], "rotations": {"vl5": [NaN, 0, 0, 0]}}',
        "{" * 1000,
        "[1, 2]",
        bytes([72]) + bytes(40),
        "{" + " " * 5000 + "}",
    ],
)
async def test_malformed_sample_closes_only_its_connection(tmp_path: Path, message: str | bytes) -> None:
    with run_server(tmp_path) as url:
        async with Client(url) as client, client.perform() as performer:
            address = client.socket_url(performer.description["input"])
            async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as hostile:  # type: ignore[list-item]
                await hostile.send(message)
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    await hostile.wait_closed()
                assert hostile.close_code in (1008, 1009)
            assert (await performer.describe())["id"] == performer.description["id"]
