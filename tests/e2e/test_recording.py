"""Recording of a controlled session, and playback of the recording, over real connections."""

from __future__ import annotations

import asyncio
import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bunraku.cli import app
from bunraku.client import Client, Puppeteer, ServerProblem, Viewer
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import Pose
from bunraku.runtime.clock import clock
from tests.patient_viewer import PatientViewer, watch_until
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S

LIMB = "left_hand"


async def watch_controlled_session(
    client: Client, session: str, seconds: float, overlays: int
) -> tuple[Viewer, dict[int, Pose]]:
    """Watch a session while its left hand is controlled, for `seconds` and until the viewer has received `overlays`.

    The viewer has also seen the hand return. Return the viewer and its poses by clock time.
    """
    seen: dict[int, Pose] = {}
    viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
    async with Puppeteer(client, session) as puppeteer, asyncio.timeout(HANG_TIMEOUT_S):
        watching = asyncio.create_task(viewer.watch(2 * HANG_TIMEOUT_S, seen.__setitem__))
        await puppeteer.claim(LIMB)
        loop = asyncio.get_running_loop()
        end = loop.time() + seconds
        while (now := loop.time()) < end or viewer.statistics.overlays <= overlays:
            await puppeteer.target(LIMB, 0.7, 0.5 + 0.3 * math.sin(4 * now), 0.4)
            await asyncio.sleep(1 / 60)
        await puppeteer.release(LIMB)
        end_us = clock() + 800_000
        while not seen or max(seen) < end_us:  # noqa: ASYNC110
            await asyncio.sleep(1 / 60)
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
    return viewer, seen


def hand_tip(viewer: Viewer, pose: Pose) -> np.ndarray:
    """Return the world position of the tip of the left hand."""
    assert viewer.track is not None
    position: np.ndarray = joint_and_tip_positions(viewer.track.figure, *pose)[19]
    return position


async def test_recording_replays_what_viewers_saw(tmp_path: Path) -> None:
    source = tmp_path / "Swan.bvh"
    source.write_bytes(make_bvh_clip(3.0, 91))
    with run_server(tmp_path / "data") as url:
        async with Client(url) as client:
            dance = await client.upload(source)
            session = (await client.open_session(dance["id"]))["id"]
            viewer, seen = await watch_controlled_session(client, session, 2.0, 20)
            camera = [
                {"time": clock() - 3_000_000, "position": [0, 1.2, 4], "gaze": [0, 1, 0], "fov": 0.5},
                {"time": clock(), "position": [2, 1.2, 3], "gaze": [0, 1, 0], "fov": 0.7},
            ]
            before = clock()
            recorded = await client.record(session, "A swan's arm", 2.5, camera)
            assert recorded["name"] == "A swan's arm"
            assert recorded["kept_from"] == dance["id"]
            assert recorded["duration"] == pytest.approx(2.5, abs=0.02)
            assert (await client.motions())[0] == recorded
            assert recorded["tracks"] == ["motion", "camera"]
            again = Viewer(client.socket_url(f"/v1/motions/{recorded['id']}/stream"))

            def has_whole_recording() -> bool:
                """Return whether every block has arrived at the highest bitrate level."""
                store = again._blocks
                return (
                    again.statistics.camera_blocks >= recorded["blocks"]
                    and store is not None
                    and all(
                        store.level(index) == len(recorded["rates"]) - 1 for index in range(store.track.block_count)
                    )
                )

            await watch_until(again, has_whole_recording)
            statistics = again.statistics
            # a recording is a motion: a session can play it, and its limbs can be controlled
            second = (await client.open_session(recorded["id"]))["id"]
            controlled, _ = await watch_controlled_session(client, second, 0.5, 20)
            await client.delete_motion(dance["id"])
            assert (await client.motion(recorded["id"]))["id"] == recorded["id"]
    assert statistics.gaps == 0
    assert statistics.camera_blocks == recorded["blocks"]
    assert statistics.camera is not None
    assert controlled.statistics.overlays > 20
    state = again.timeline_history.newest
    assert state is not None
    assert again.track is not None
    # frame k of the recording was seen at the time of the request, less its length, plus a small delay
    frames = [again._blocks.pose_at(round(k * 1e6 / 60)) for k in range(150)]  # type: ignore[union-attr]
    recorded_hands = np.array([hand_tip(again, pose) for pose in frames if pose is not None])
    assert len(recorded_hands) == 150
    seen_at = np.array(sorted(seen))
    seen_hands = np.array([hand_tip(viewer, seen[t]) for t in sorted(seen)])

    def median_offset(delay: int) -> float:
        at = before + delay - 2_500_000 + np.arange(150) * 1e6 / 60
        inside = (at > seen_at[0]) & (at < seen_at[-1])
        expected = np.stack([np.interp(at[inside], seen_at, seen_hands[:, axis]) for axis in range(3)], axis=1)
        assert inside.sum() > 100
        return float(np.median(np.linalg.norm(recorded_hands[inside] - expected, axis=1)))

    assert min(median_offset(delay) for delay in range(0, 200_000, 2_000)) < 0.01


async def test_invalid_recording_request_is_rejected(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        with pytest.raises(ServerProblem, match="No such session"):
            await client.record("none")
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        for seconds in (-1.0, 601.0):
            with pytest.raises(ServerProblem, match="seconds"):
                await client.record(session, seconds=seconds)
        with pytest.raises(ServerProblem, match="camera"):
            await client.record(session, camera=[{"time": 5, "position": [0, 1], "gaze": [0, 1, 0], "fov": 0.5}])


def test_keep_command_accepts_session_id_and_page_url(server: str, clip_file: Path) -> None:
    async def open_session() -> str:
        async with Client(server) as client:
            session: str = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
            await PatientViewer(client.socket_url(f"/v1/sessions/{session}/stream")).watch(0.5)
        return session

    session = asyncio.run(open_session())
    run = CliRunner()
    by_id = run.invoke(app, ["keep", session, "--server", server, "--name", "Mine", "--json"])
    assert by_id.exit_code == 0, by_id.output
    assert json.loads(by_id.stdout)["name"] == "Mine"
    by_page = run.invoke(app, ["keep", f"{server}/?session={session}", "--seconds", "0.3"])
    assert by_page.exit_code == 0, by_page.output
    assert f"{clip_file.stem}, kept" in by_page.stdout
