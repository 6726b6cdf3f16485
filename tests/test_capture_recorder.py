"""`bunraku capture` as a process: packets of VMC by UDP become a BVH file."""

from __future__ import annotations

import asyncio
import json
import re
import signal
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bunraku import capture_recorder
from bunraku.capture.session import TimedPose
from bunraku.capture.vmc import VmcAssembler
from bunraku.capture_recorder import CaptureReceiver, describe_capture, explain_empty_take
from bunraku.motion.analysis import analyse
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.capture.capture_process import FPS, make_packet, run_capture, send_packets
from tests.processes import free_port


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "stopped"])
def test_take_is_saved_at_its_end_and_can_be_read_again(tmp_path: Path, stop: signal.Signals) -> None:
    port, file = free_port(), tmp_path / "take.bvh"

    async def record() -> bytes:
        async with run_capture("vmc", str(file), "--port", str(port), "--fps", "60", "--json") as process:
            await send_packets(port, 90)
            process.send_signal(stop)
            output, errors = await process.communicate()
        assert process.returncode == 0, errors
        return output

    statistics = json.loads(asyncio.run(record()))
    assert (statistics["invalid"], statistics["problem"]) == (0, None)
    assert statistics["received"] >= 80
    analysis = analyse(parse_bvh(file.read_bytes()))
    assert analysis.motion.fps == pytest.approx(60.0)
    assert analysis.motion.frame_count == statistics["frames"] > 60
    # a standing body: its head is above its feet
    points = joint_and_tip_positions(analysis.motion.figure, analysis.motion.root, analysis.motion.rotations)
    assert np.median(points[:, 11, 1] - points[:, 4, 1]) > 1.0
    assert list(tmp_path.iterdir()) == [file]


async def test_take_ends_by_itself_after_the_given_time(tmp_path: Path) -> None:
    port, file = free_port(), tmp_path / "take.bvh"
    async with run_capture("vmc", str(file), "--port", str(port), "--seconds", "0.5", "--json") as process:
        sending = asyncio.create_task(send_packets(port, 10_000))
        output, errors = await process.communicate()
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
    assert process.returncode == 0, errors
    assert json.loads(output)["seconds"] >= 0.5


def test_take_without_a_packet_says_so_and_saves_nothing(tmp_path: Path) -> None:
    async def record() -> str:
        async with run_capture("vmc", str(tmp_path / "take.bvh"), "--port", str(free_port())) as process:
            process.send_signal(signal.SIGINT)
            _, errors = await process.communicate()
        assert process.returncode == 1
        return errors.decode()

    assert "No packet arrived at 127.0.0.1, port" in re.sub(r"\s+", " ", asyncio.run(record()))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("packets", "message"),
    [([b"hello"], "No packet could be read as VMC"), ([make_packet(0), make_packet(1)], "The take is too short")],
    ids=["invalid", "short"],
)
def test_take_without_a_pose_is_explained(packets: list[bytes], message: str) -> None:
    receiver = CaptureReceiver(VmcAssembler(), lambda: 1.0)
    for data in packets:
        receiver.datagram_received(data, ("127.0.0.1", 1))
    assert message in explain_empty_take(receiver, "VMC", ("127.0.0.1", 39539))


def test_invalid_packets_change_nothing_and_a_take_has_a_maximum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture_recorder, "MAX_TAKE_POSES", 20)
    now = 0.0
    receiver = CaptureReceiver(VmcAssembler(), lambda: now)
    for number in range(60):
        now = 10.0 + number / FPS
        receiver.datagram_received(make_packet(number), ("127.0.0.1", 1))
        receiver.datagram_received(b"\x00\xff" * 40, ("127.0.0.1", 1))
        receiver.poll()
    assert receiver.is_full
    assert (len(receiver.poses), receiver.invalid, receiver.datagrams) == (20, 60, 120)
    assert receiver.problem is not None


def test_figure_of_the_first_calibration_stays_and_poses_are_passed_on() -> None:
    now, passed = 0.0, 0

    def on_poses(poses: Sequence[TimedPose]) -> None:
        nonlocal passed
        passed += len(poses)

    receiver = CaptureReceiver(VmcAssembler(), lambda: now, keeps_poses=False, on_poses=on_poses)

    def send(numbers: range) -> None:
        nonlocal now
        for number in numbers:
            now = 10.0 + number / FPS
            receiver.datagram_received(make_packet(number), ("127.0.0.1", 1))

    send(range(60))
    figure, calibration = receiver.figure, receiver.session.calibration
    receiver.recalibrate()
    assert "calibrating again" in describe_capture(receiver, None, FPS)
    send(range(60, 120))
    assert receiver.session.calibration is not calibration
    assert receiver.figure is figure
    assert (receiver.poses, passed) == ([], receiver.pose_count)
    assert passed == 90


async def test_recording_can_be_calibrated_again_by_a_key(tmp_path: Path) -> None:
    port = free_port()
    async with run_capture("vmc", str(tmp_path / "take.bvh"), "--port", str(port), "--json") as process:
        assert process.stdin is not None
        process.stdin.write(b"c\nx\n")
        await process.stdin.drain()
        await send_packets(port, 60)
        process.send_signal(signal.SIGTERM)
        output, errors = await process.communicate()
    assert process.returncode == 0, errors
    assert json.loads(output)["frames"] > 10
