"""`bunraku capture` as a process: packets of VMC by UDP become a BVH file."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pytest

from bunraku import capture_recorder
from bunraku.capture.vmc import VmcAssembler
from bunraku.capture_recorder import CaptureReceiver, explain_empty_take
from bunraku.motion.analysis import analyse
from bunraku.motion.bvh import parse_bvh
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.capture.samples import sample_performance
from tests.capture.vmc_performer import make_bundle, make_messages
from tests.processes import free_port
from tests.time_limit import HANG_TIMEOUT_S

BUNRAKU = Path(sys.executable).parent / "bunraku"
FPS = 30.0


def packet(number: int) -> bytes:
    performance = sample_performance()
    return make_bundle(make_messages(performance, number % performance.frame_count, number / FPS))


@asynccontextmanager
async def run_capture(*arguments: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """Run `bunraku capture`, from the moment at which it listens, and end it."""
    process = await asyncio.create_subprocess_exec(
        BUNRAKU, "capture", *arguments, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    try:
        assert process.stderr is not None
        async with asyncio.timeout(HANG_TIMEOUT_S):
            assert b"Listening for VMC" in await process.stderr.readline()
            yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.communicate()


async def send_packets(port: int, count: int) -> None:
    """Send the packets of a performer in real time: times of frames come from their arrivals, too."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(count):
            sender.sendto(packet(number), ("127.0.0.1", port))
            await asyncio.sleep(1 / FPS)


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
    [([b"hello"], "No packet could be read as VMC"), ([packet(0), packet(1)], "The take is too short")],
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
        receiver.datagram_received(packet(number), ("127.0.0.1", 1))
        receiver.datagram_received(b"\x00\xff" * 40, ("127.0.0.1", 1))
        receiver.poll()
    assert receiver.is_full
    assert (len(receiver.poses), receiver.invalid, receiver.datagrams) == (20, 60, 120)
    assert receiver.problem is not None
