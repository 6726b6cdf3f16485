from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest

from bunraku.client import Client, StreamEnded, Viewer
from bunraku.motion.skeleton import points
from bunraku.playout.blocks import Pose
from tests.vectors.blocks import wandering_motion


async def test_it_shows_the_dance_that_was_uploaded(server: str, tmp_path: Path) -> None:
    from tests.servers import clip

    source = tmp_path / "clip.bvh"
    source.write_bytes(clip(3.0, 77))
    async with Client(server) as client:
        motion = await client.upload(source)
        viewer = Viewer(client.socket_url(f"/v1/motions/{motion['id']}/stream?rate=3"))
        shown: dict[int, Pose] = {}
        figures = await viewer.watch(1.5, shown.__setitem__)
    assert figures.first_pose_ms is not None
    assert figures.gaps == 0
    assert figures.frames == len(shown) > 20
    assert figures.rate == 3
    assert figures.bytes > 1000
    assert figures.clock_error_ms is not None
    state = viewer.timelines.newest
    assert state is not None
    assert viewer.track is not None
    truth = wandering_motion(3.0, 30.0, 77)
    late = max(t for t in shown if (t - state.clock) % 3_000_000 < 2_900_000)
    position = (late - state.clock) % 3_000_000
    frame = round(position * 30 / 1e6)
    expected = points(truth.figure, truth.root[frame] * 0.1 + [0, 0.85, 0], truth.rotations[frame])
    error = np.linalg.norm(points(viewer.track.figure, *shown[late]) - expected, axis=-1)
    assert error.mean() < 0.15  # within a frame's movement


async def test_two_viewers_of_a_session_show_the_same_pose_at_the_same_time(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = await client.open_session((await client.upload(clip_file))["id"])
        url = client.socket_url(f"/v1/sessions/{session['id']}/stream?rate=3")
        viewers = [Viewer(url), Viewer(url)]
        await asyncio.gather(*(viewer.watch(1.0) for viewer in viewers))
        # the same instant of the machine's clock, each by its own idea of the reference clock
        now = __import__("time").monotonic_ns() // 1000
        times = [viewer.clock.at(now) for viewer in viewers]
        assert abs(times[0] - times[1]) < 16_667
        poses = [viewer.pose_at(times[0]) for viewer in viewers]
    assert poses[0] is not None
    assert poses[1] is not None
    np.testing.assert_allclose(poses[0][1], poses[1][1], atol=0.02)


async def test_a_stream_that_is_refused_says_why(server: str) -> None:
    async with Client(server) as client:
        with pytest.raises(StreamEnded, match="No such motion"):
            await Viewer(client.socket_url("/v1/motions/none/stream")).watch(1)
