"""`bunraku capture` as a process that streams: packets of VMC by UDP are seen on the stage, and become a motion."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from bunraku.client import Client, Viewer
from bunraku.http.access_control import Role
from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure, world_transforms
from bunraku.playout.block_store import Pose
from bunraku.session.live import performer_endpoint
from tests.capture.capture_process import FPS, performing, run_capture
from tests.capture.samples import PELVIS, sample_analysis
from tests.credentials import SECRET, make_token
from tests.e2e.test_live import wait_for_live, wait_for_motion, watching
from tests.processes import ServerProcess, free_port
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S

MAX_ERROR_MM = 20.0
"""Bound of the error on the stage: the fit of the calibration and of the file, and the live blocks."""


async def read_stage(process: asyncio.subprocess.Process) -> str:
    """Return the session that a capture prints as the address of its stage."""
    assert process.stderr is not None
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while line := (await process.stderr.readline()).decode():
            if (found := re.search(r"Live on the stage at http://\S+/\?session=(\S+)", line)) is not None:
                return found[1]
    raise AssertionError("the capture has ended without a stage")


async def stop(process: asyncio.subprocess.Process, number: signal.Signals) -> dict[str, object]:
    """Send a signal and return the statistics that the process prints."""
    process.send_signal(number)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        output, errors = await process.communicate()
    assert process.returncode == 0, errors
    statistics: dict[str, object] = json.loads(output)
    return statistics


def joint_positions(figure: Figure, root: Array, rotations: Array) -> Array:
    """Return the positions (n, 17, 3) of the joints; only clips have one for the pelvis."""
    return np.delete(world_transforms(figure, root, rotations)[0], PELVIS, axis=1)


def error_mm(figure: Figure, shown: dict[int, Pose], sent_us: dict[int, int]) -> float:
    """Return the median distance of shown poses from the source; `shown` has times of `sent_us`.

    Each pose is compared with the source up to 1 s before, as the delay changes on a busy machine.
    """
    motion = sample_analysis().motion
    placed = joint_positions(motion.figure, motion.root, motion.rotations)
    numbers = np.array(sorted(sent_us))
    times = [sent_us[number] for number in numbers]
    poses = [shown[at] for at in sorted(shown)]
    found = joint_positions(figure, np.array([root for root, _ in poses]), np.array([turn for _, turn in poses]))
    nearest = np.full(len(found), np.inf)
    for lag_us in range(0, 1_000_000, 5_000):
        # the frame after the last one is the first
        at = np.interp(np.array(sorted(shown)) - lag_us, times, numbers) % len(placed)
        low, share = at.astype(int), (at % 1)[:, None, None]
        expected = placed[low] + share * (placed[(low + 1) % len(placed)] - placed[low])
        nearest = np.minimum(nearest, np.linalg.norm(found - expected, axis=-1).mean(axis=-1))
    return 1000.0 * float(np.median(nearest))


@pytest.mark.parametrize("stop_signal", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-c", "stopped"])
async def test_captured_performer_is_on_stage_and_becomes_a_motion(tmp_path: Path, stop_signal: signal.Signals) -> None:
    port, file, sent_us = free_port(), tmp_path / "take.bvh", dict[int, int]()
    with run_server(tmp_path / "data") as url:
        options = ["--server", url, "--name", "Aiko", "--port", str(port), "--json"]
        async with Client(url) as client, run_capture("vmc", str(file), *options) as process, performing(port, sent_us):
            session = await read_stage(process)
            async with watching(client, session) as (viewer, seen):
                await wait_for_live(viewer, 120)
                assert viewer.presence is not None
                assert [live["name"] for live in viewer.presence.live or ()] == ["Aiko"]
                figure, offset = viewer.track.figure, viewer.clock.slewed_offset  # type: ignore[union-attr]
            shown = {round(at - offset): pose for at, pose in seen.items() if at > max(seen) - 1_000_000}
            assert error_mm(figure, shown, sent_us) < MAX_ERROR_MM
            statistics = await stop(process, stop_signal)
            assert statistics["session"] == session
            assert statistics["sent"] > 60  # type: ignore[operator]
            assert (statistics["reconnects"], statistics["problem"]) == (0, None)
            motion = await wait_for_motion(client, str(statistics["motion"]))
            assert motion["name"] == "Aiko"
            assert motion["duration"] > 1.0  # type: ignore[operator]
            recorded = parse_bvh(file.read_bytes())
            assert recorded.fps == pytest.approx(60.0)
            assert len(recorded.frames) == statistics["frames"]


def live_count(viewer: Viewer) -> int:
    """Return how many performers are live."""
    return len((viewer.presence and viewer.presence.live) or ())


async def test_performance_of_a_killed_capture_ends_by_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(performer_endpoint, "RECONNECT_TIMEOUT_US", 1_000_000)
    port = free_port()
    with run_server(tmp_path) as url:
        options = ["--server", url, "--port", str(port), "--fps", "30"]
        async with Client(url) as client, performing(port), run_capture("vmc", *options) as process:
            async with watching(client, await read_stage(process)) as (viewer, _):
                await wait_for_live(viewer, 30)
                assert live_count(viewer) == 1
                process.kill()
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    while live_count(viewer) or not (found := await client.motions()):  # noqa: ASYNC110
                        await asyncio.sleep(0.05)
            assert found[0]["fps"] == 30.0


async def test_performer_is_on_a_stage_again_after_a_restart_of_the_server(tmp_path: Path) -> None:
    port, server_port = free_port(), free_port()
    bunraku = str(Path(sys.executable).parent / "bunraku")
    command = [bunraku, "up", "--port", str(server_port), "--data", str(tmp_path / "data")]
    server = ServerProcess(command, server_port, tmp_path)
    url = f"http://127.0.0.1:{server_port}"
    server.start()
    try:
        async with run_capture("vmc", "--server", url, "--port", str(port), "--json") as process, performing(port):
            first = await read_stage(process)
            await asyncio.to_thread(server.kill)
            await asyncio.to_thread(server.start)
            second = await read_stage(process)
            assert first != second
            async with Client(url) as client, watching(client, second) as (viewer, _):
                await wait_for_live(viewer, 10)
            statistics = await stop(process, signal.SIGTERM)
            assert statistics["reconnects"] >= 1  # type: ignore[operator]
            assert statistics["session"] == second
    finally:
        server.stop()


async def test_unknown_session_is_reported_before_listening(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        errors = await run_failing("vmc", "--server", url, "--session", "nobody", "--port", str(free_port()))
    assert "no session" in errors.lower()
    assert "Listening" not in errors


async def test_unreachable_server_is_reported_before_listening() -> None:
    errors = await run_failing("vmc", "--server", f"http://127.0.0.1:{free_port()}")
    assert "Cannot reach Bunraku at http://127.0.0.1" in errors


async def run_failing(*arguments: str) -> str:
    """Run a capture that ends at once with an error, and return what it prints about that."""
    bunraku = Path(sys.executable).parent / "bunraku"
    process = await asyncio.create_subprocess_exec(
        bunraku, "capture", *arguments, stdin=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE
    )
    async with asyncio.timeout(HANG_TIMEOUT_S):
        _, errors = await process.communicate()
    assert process.returncode == 1
    return errors.decode()


async def test_token_without_the_role_ends_the_command_with_the_reason(tmp_path: Path) -> None:
    port = free_port()
    with run_server(tmp_path, secret=SECRET) as url:
        options = ["--server", url, "--port", str(port), "--token", make_token(Role.VIEW)]
        async with run_capture("vmc", *options) as process, performing(port):
            async with asyncio.timeout(HANG_TIMEOUT_S):
                _, errors = await process.communicate()
    assert process.returncode == 1
    assert "role" in errors.decode()


async def test_file_is_played_to_its_end_and_is_a_motion_then(tmp_path: Path) -> None:
    clip = tmp_path / "clip.bvh"
    clip.write_bytes(write_bvh(sample_analysis().motion))
    with run_server(tmp_path / "data") as url:
        async with Client(url) as client:
            session = (await client.open_session((await client.upload(clip))["id"]))["id"]
            address = f"{url}/?session={session}"
            process = await asyncio.create_subprocess_exec(
                Path(sys.executable).parent / "bunraku", "capture", "bvh", clip, "--session", address, "--json",
                "--name", "Yuki", "--place", "0,2,180", stdout=asyncio.subprocess.PIPE,
            )  # fmt: skip
            async with asyncio.timeout(HANG_TIMEOUT_S):
                output, _ = await process.communicate()
            assert process.returncode == 0
            statistics = json.loads(output)
            frames = sample_analysis().motion.frame_count
            assert (statistics["session"], statistics["performer"], statistics["sent"]) == (session, 1, frames)
            motion = await wait_for_motion(client, statistics["motion"])
            assert motion["duration"] == pytest.approx(frames / FPS, abs=0.1)
