"""Frames of a real server's sessions, sent to a real UDP socket and read back independently."""

from __future__ import annotations

import asyncio
import math
import struct
import time
from pathlib import Path

import numpy as np
import pytest

from bunraku.client import Client, Puppeteer, Viewer
from bunraku.client.datagram import DatagramSender
from bunraku.client.stage_output import DmxOutput, OscOutput, PerformerMissing, VmcOutput, pack_artnet, pack_sacn
from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.output.dmx import Universe
from bunraku.playout.block_store import Pose
from bunraku.storage.motion_store import MotionStore
from tests.datagrams import receive_datagrams
from tests.output.bone_angles import max_bone_angle, tip_positions
from tests.output.vmc_receiver import parse_packet, receive_frame
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera, sample_light

MAX_ANGLE_DEG = 0.1
LEFT_HAND_OF_SECOND = 4


async def store_pair(folder: Path) -> None:
    """Store the motion `pair`: two performers, a camera and two lights."""
    first, second = (
        encode_motion(random_motion(4.0, 30.0, seed), error_bounds_mm=(30.0, 5.0), grade="live") for seed in (5, 6)
    )
    camera, light = sample_camera(4.0, 30.0), sample_light(4.0, 30.0)
    scenes = [encode_scene(scene, error_bounds_mm=(20.0, 1.0)) for scene in (light, camera, light)]
    await MotionStore.open(f"file://{folder}/library").put("pair", pack_motion("pair", first, scenes, others=[second]))


async def move_hand(puppeteer: Puppeteer, limb: int) -> None:
    """Move a held hand on a circle until cancelled."""
    loop = asyncio.get_running_loop()
    while True:
        now = loop.time()
        await puppeteer.target(limb, 0.6, 0.5 + 0.3 * math.sin(4 * now), 0.5 * math.cos(4 * now))
        await asyncio.sleep(1 / 60)


async def test_vmc_frames_have_the_stage_pose_with_a_controlled_limb(tmp_path: Path) -> None:
    await store_pair(tmp_path)
    poses: list[tuple[int, Pose]] = []
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            session = (await client.open_session("pair"))["id"]
            viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
            async with (
                Puppeteer(client, session) as puppeteer,
                receive_datagrams() as receiver,
                DatagramSender("127.0.0.1", receiver.port) as sender,
            ):
                await puppeteer.claim(LEFT_HAND_OF_SECOND)
                moving = asyncio.create_task(move_hand(puppeteer, LEFT_HAND_OF_SECOND))
                output = VmcOutput(viewer, sender.send, performer=1)
                overlays: list[int] = []
                enough = asyncio.Event()

                def on_frame(reference: int, pose: Pose) -> None:
                    output.on_frame(reference, pose)
                    if output.frames > len(poses):
                        second = viewer.pose_at(reference, 1)
                        assert second is not None
                        poses.append((reference, second))
                        overlays.append(viewer.statistics.overlays)
                    if len(poses) >= 100 and overlays[-1] - overlays[0] >= 40:
                        enough.set()

                watching = asyncio.create_task(viewer.watch(HANG_TIMEOUT_S, on_frame))
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    await enough.wait()
                watching.cancel()
                moving.cancel()
                await asyncio.gather(watching, moving, return_exceptions=True)
                await receiver.wait_until(lambda received: len(received) == sender.sent)
                track, state = viewer.performers[1], viewer.timeline_history.newest
                assert track is not None
                assert state is not None
    assert sender.dropped == 0
    assert len(receiver.received) == len(poses)
    motion = random_motion(4.0, 30.0, 6)
    angles, distances = [], []
    for datagram, (reference, pose) in zip(receiver.received, poses, strict=True):
        frame = receive_frame(parse_packet(datagram))
        assert frame.seconds == pytest.approx((reference - poses[0][0]) / 1e6, abs=1e-5)
        angles.append(max_bone_angle(frame, track.figure, *pose))
        uncontrolled = motion.rotations[round((reference - state.clock) % 4_000_000 * 30 / 1e6) % 120]
        distances.append(np.abs(pose[1][12] - uncontrolled[12]).max())
    assert max(angles) < MAX_ANGLE_DEG
    # the compared poses are those of a controlled arm
    assert max(distances) > 0.2


async def test_performer_that_is_not_on_the_stage_is_reported(tmp_path: Path) -> None:
    await store_pair(tmp_path)
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            session = (await client.open_session("pair"))["id"]
            viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
            output = VmcOutput(viewer, lambda _: None, performer=2)
            with pytest.raises(PerformerMissing, match="the stage has 2 performers, counted from 0"):
                await viewer.watch(HANG_TIMEOUT_S, output.on_frame)


async def test_osc_and_dmx_have_the_lights_of_the_stage(tmp_path: Path) -> None:
    await store_pair(tmp_path)
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            session = (await client.open_session("pair"))["id"]
            viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
            sent: dict[str, list[bytes]] = {"osc": [], "sacn": [], "artnet": []}
            osc = OscOutput(viewer, sent["osc"].append)
            sacn = DmxOutput(
                viewer, sent["sacn"].append, Universe(1, "rgbd"), pack_sacn(7, 150, bytes(16)), final_packets=3
            )
            artnet = DmxOutput(viewer, sent["artnet"].append, Universe(101, "rgb"), pack_artnet(0x123), final_packets=0)
            frames: list[tuple[int, list[np.ndarray | None], Pose, Pose | None]] = []
            enough = asyncio.Event()

            def on_frame(reference: int, pose: Pose) -> None:
                values = [viewer.scene_at(reference, number) for number in range(len(viewer.scenes))]
                if len(values) < 3 or any(value is None for value in values):
                    return
                for output in (osc, sacn, artnet):
                    output.on_frame(reference, pose)
                frames.append((reference, values, pose, viewer.pose_at(reference, 1)))
                if len(frames) == 60:
                    enough.set()

            watching = asyncio.create_task(viewer.watch(HANG_TIMEOUT_S, on_frame))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                await enough.wait()
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
    assert [track.kind for track in viewer.scenes] == ["light", "camera", "light"]
    full = viewer.scenes[0].full
    assert len(sent["osc"]) == len(frames)
    for datagram, (_, values, first, second) in zip(sent["osc"], frames, strict=True):
        messages = {address: [float(number) for number in numbers] for address, numbers in parse_packet(datagram)}
        assert len(messages) == 1 + 2 * 3 + (8 if second is not None else 4)
        for light, scene in enumerate((0, 2)):
            received = [
                number
                for part in ("position", "colour", "intensity")
                for number in messages[f"/bunraku/light/{light}/{part}"]
            ]
            np.testing.assert_allclose(received, values[scene], rtol=1e-6, atol=1e-6)  # type: ignore[arg-type]
        for performer, pose in enumerate((first, second)):
            track = viewer.performers[performer]
            if pose is not None:
                assert track is not None
                np.testing.assert_allclose(
                    messages[f"/bunraku/performer/{performer}/right_hand/position"],
                    tip_positions(track.figure, *pose)["r_wrist"],
                    atol=1e-5,
                )
    # a moving light changes nearly every packet; the last ones have the values of the last frame
    for output in (osc, sacn, artnet):
        output.finish()
    colour, intensity = frames[-1][1][0][3:6], frames[-1][1][0][6] / full  # type: ignore[index]
    expected = [round(255 * share) for share in (*np.clip(colour, 0, 1), min(intensity, 1.0))]
    assert list(sent["sacn"][-1][126:134]) == expected * 2
    assert [packet[112] for packet in sent["sacn"][-4:]] == [0, 0x40, 0x40, 0x40]
    assert [packet[111] for packet in sent["sacn"]] == [nth % 256 for nth in range(len(sent["sacn"]))]
    assert {packet[108] for packet in sent["sacn"]} == {150}
    assert {struct.unpack_from("<BB", packet, 14) for packet in sent["artnet"]} == {(0x23, 0x01)}
    dimmed = [round(255 * min(intensity, 1.0) * share) for share in np.clip(colour, 0, 1)]
    assert list(sent["artnet"][-1][18 + 100 : 18 + 106]) == dimmed * 2
    assert len(sent["osc"]) == len(frames), "OSC has no end"


def test_dmx_that_sent_nothing_ends_nothing() -> None:
    sent: list[bytes] = []
    viewer = Viewer("ws://stage/stream")
    DmxOutput(viewer, sent.append, Universe(1, "rgb"), pack_sacn(1, 100, bytes(16)), final_packets=3).finish()
    assert sent == []


async def test_stall_is_not_followed_by_a_burst_of_frames(server: str, clip_file: Path) -> None:
    interval, stall = 1 / 100, 0.5
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
    sent: list[float] = []
    enough, loop = asyncio.Event(), asyncio.get_running_loop()
    output = VmcOutput(viewer, lambda _: sent.append(loop.time()))

    def on_frame(reference: int, pose: Pose) -> None:
        output.on_frame(reference, pose)
        if len(sent) == 20:
            # the process is suspended
            time.sleep(stall)
        elif len(sent) == 60:
            enough.set()

    watching = asyncio.create_task(viewer.watch(HANG_TIMEOUT_S, on_frame, frame_interval=interval))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await enough.wait()
    watching.cancel()
    await asyncio.gather(watching, return_exceptions=True)
    after = np.array(sent[20:])
    # whatever the machine does, no frame comes before its time: at most one is late when the row begins
    assert np.all(after - after[0] >= (np.arange(len(after)) - 1) * interval - 1e-3)
