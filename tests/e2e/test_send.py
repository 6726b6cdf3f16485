"""`bunraku send` as a process: a paused stage with a controlled hand is received by UDP, until Ctrl-C."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pytest

from bunraku.client import Client, Puppeteer, Viewer
from bunraku.motion.skeleton import JOINT_INDEX
from bunraku.playout.block_store import Pose
from tests.datagrams import receive_datagrams
from tests.output.bone_angles import max_bone_angle
from tests.output.vmc_receiver import Message, parse_packet, receive_frame
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S

BUNRAKU = Path(sys.executable).parent / "bunraku"
COMPARED_FRAMES = 60
MESSAGES_PER_FRAME = 25
MAX_ANGLE_DEG = 0.1
SHOULDER = JOINT_INDEX["l_shoulder"]


@asynccontextmanager
async def run_send(*arguments: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """Run `bunraku send` and end it."""
    process = await asyncio.create_subprocess_exec(
        BUNRAKU, "send", *arguments, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    try:
        yield process
    finally:
        if process.returncode is None:
            process.kill()
            await process.communicate()


async def interrupt(process: asyncio.subprocess.Process) -> tuple[str, str]:
    """Press Ctrl-C and return what the process printed."""
    process.send_signal(signal.SIGINT)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        output, errors = await process.communicate()
    return output.decode(), errors.decode()


async def watch_until_settled(viewer: Viewer) -> Pose:
    """Return the pose of a paused stage, with the limbs that are held still, once it no longer changes."""
    poses: list[Pose] = []
    settled = asyncio.Event()

    def on_frame(_: int, pose: Pose) -> None:
        poses.append(pose)
        # the overlays of a second, during which the hand was there
        if viewer.statistics.overlays > 30 and len(poses) > 60 and np.allclose(pose[1], poses[-60][1], atol=1e-6):
            settled.set()

    watching = asyncio.create_task(viewer.watch(HANG_TIMEOUT_S, on_frame))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await settled.wait()
    watching.cancel()
    await asyncio.gather(watching, return_exceptions=True)
    return poses[-1]


def split_frames(datagrams: list[bytes]) -> list[list[Message]]:
    """Return the messages of each frame, of which the time is the last one.

    Frames of which a datagram was lost are left out: the receiver shares two processors with the server.
    """
    frames: list[list[Message]] = [[]]
    for message in (message for datagram in datagrams for message in parse_packet(datagram)):
        frames[-1].append(message)
        if message[0] == "/VMC/Ext/T":
            frames.append([])
    return [frame for frame in frames[:-1] if len(frame) == MESSAGES_PER_FRAME]


@pytest.mark.parametrize("single", [False, True])
async def test_vmc_of_a_process_has_the_pose_of_another_viewer(tmp_path: Path, clip_file: Path, single: bool) -> None:
    options = ["--json", "--single", "--fps", "20"] if single else ["--json"]
    datagrams_per_frame = MESSAGES_PER_FRAME if single else 1
    with run_server(tmp_path) as url:
        async with Client(url) as client, receive_datagrams() as receiver:
            session = (await client.open_session((await client.upload(clip_file))["id"], playing=False))["id"]
            async with Puppeteer(client, session) as puppeteer:
                await puppeteer.claim("left_hand")
                await puppeteer.target("left_hand", 0.5, 0.7, 0.3)
                viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
                root, rotations = await watch_until_settled(viewer)
                track = viewer.track
                assert track is not None

                def angle(messages: list[Message]) -> float:
                    return max_bone_angle(receive_frame(messages), track.figure, root, rotations)

                def is_best_level(received: list[bytes]) -> bool:
                    if len(received) % datagrams_per_frame:
                        return False
                    frames = split_frames(received[-2 * datagrams_per_frame :])
                    return bool(frames) and angle(frames[-1]) < MAX_ANGLE_DEG

                to = f"127.0.0.1:{receiver.port}"
                async with run_send("vmc", session, "--to", to, "--server", url, *options) as process:
                    await receiver.wait_until(is_best_level)
                    first = len(receiver.received)
                    await receiver.wait_until(
                        lambda received: len(received) >= first + COMPARED_FRAMES * datagrams_per_frame
                    )
                    printed, errors = await interrupt(process)
    assert process.returncode == 0, errors
    frames = split_frames(receiver.received[first:])
    angles = [angle(messages) for messages in frames]
    assert len(angles) >= COMPARED_FRAMES / 2
    assert max(angles) < MAX_ANGLE_DEG
    statistics = json.loads(printed)
    assert statistics["datagrams"] == statistics["frames"] * datagrams_per_frame
    assert (statistics["dropped"], statistics["problem"], statistics["performers"]) == (0, None, 1)
    state = viewer.timeline_history.newest
    assert state is not None
    stored = viewer._tracks.first_performer.pose_at(state.position)  # type: ignore[union-attr]
    assert stored is not None
    assert np.abs(rotations[SHOULDER] - stored[1][SHOULDER]).max() > 0.1, "the hand is controlled"


async def test_sacn_of_a_process_ends_its_stream(tmp_path: Path) -> None:
    with run_server(tmp_path, demo=True) as url:
        async with Client(url) as client, receive_datagrams() as receiver:
            session = await client.first_session()
            assert session is not None
            to = f"127.0.0.1:{receiver.port}"
            async with run_send("dmx", session, "--to", to, "--universe", "9", "--server", url) as process:
                await receiver.wait_until(lambda received: len(received) >= 10)
                printed, errors = await interrupt(process)
            await receiver.wait_until(lambda received: len(received) >= 3 and received[-3][112] == 0x40)
    assert process.returncode == 0, errors
    assert "lights" in printed
    assert {packet[113:115] for packet in receiver.received} == {b"\0\x09"}
    assert any(packet[126:] != bytes(512) for packet in receiver.received)
