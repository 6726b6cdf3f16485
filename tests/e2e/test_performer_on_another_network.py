"""A performer joins from another network over a lossy link, while two friends hold both hands and a leg.

Three network namespaces are the performer's computer with the capture tool, a second one with `bunraku capture`, and
the server, to which friends and viewer connect. A second performer, whose packets are not lost, is the reference.
"""

from __future__ import annotations

import asyncio
import math
import os
import signal
import sys
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from bunraku.client import Client, Puppeteer, Viewer
from bunraku.marionette.limb_rig import Limb
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_INDEX, Motion
from tests.bench.live_stage import CAPTURE_FPS, Source, place_points, run_server_process
from tests.capture.capture_process import run_capture
from tests.e2e.held_performer import (
    FrameRecorder,
    check_archive,
    check_free_limbs,
    check_held_limbs,
    check_smoothness,
    target_at,
)
from tests.e2e.test_capture_stream import read_stage, stop
from tests.e2e.test_live import wait_for_live
from tests.motion.synthetic_motion import export_bvh, pose_with_arms, smooth_motion
from tests.namespaces import command_in, in_namespace, join_namespaces, open_namespace, require_namespaces
from tests.time_limit import COROUTINE_TIMEOUT_S, HANG_TIMEOUT_S

REPOSITORY = Path(__file__).resolve().parents[2]
PORTS = 39539, 39540
SERVER_PORT = 18080
SETTLE_MESSAGES = 120
"""Live messages, 30 per second, until delays have settled."""
FRAMES = 300
"""Frames at 60 Hz that are compared."""
MAX_WINDOWS = 20
"""Most times that `FRAMES` are recorded: on a busy machine friends lose limbs, and poses jump without losses."""
FRIENDS = (Limb.LEFT_HAND, Limb.LEFT_LEG), (Limb.RIGHT_HAND,)
"""Limbs of each friend."""


class Machines(NamedTuple):
    """Namespaces, and the addresses that one has for the next."""

    tool: str
    desk: str
    venue: str
    desk_address: str
    venue_address: str


@pytest.fixture
def machines() -> Iterator[Machines]:
    require_namespaces()
    with ExitStack() as stack:
        names = [f"bunraku{os.getpid()}{name}" for name in ("tool", "desk", "venue")]
        tool, desk, venue = [stack.enter_context(open_namespace(name)) for name in names]
        yield Machines(tool, desk, venue, join_namespaces(tool, desk, 0)[1], join_namespaces(desk, venue, 1)[1])


def make_clip() -> bytes:
    """Return a clip of two seconds that stands still at both ends, as it is played forth and back."""
    quick = smooth_motion(frames=12_001, swing=0.4, fps=6_000.0)
    frames = np.round(6_000 * (1.0 - np.cos(np.linspace(0.0, math.pi, 120)))).astype(int)
    motion = Motion(quick.figure, CAPTURE_FPS, quick.root[frames], quick.rotations[frames])
    motion.rotations[:, JOINT_INDEX["sacroiliac"]] = rotation.IDENTITY
    return export_bvh(motion, pose_with_arms(90.0))


async def hold(friend: Puppeteer, limbs: Sequence[Limb]) -> None:
    """Hold limbs of both performers and move them until cancelled."""
    numbers = [4 * performer + limb for performer in (0, 1) for limb in limbs]
    for number in numbers:
        await friend.claim(number)
    while True:
        for number in numbers:
            await friend.target(number, *target_at(Limb(number % 4), time.monotonic()))
        await asyncio.sleep(1 / 30)


@asynccontextmanager
async def performing(machines: Machines, clip: Path, port: int, *, faulty: bool) -> AsyncIterator[int]:
    """Send packets from the tool's computer; yield the time of the first on `time.monotonic`, microseconds."""
    sender = await asyncio.create_subprocess_exec(
        *command_in(machines.tool), sys.executable, "-m", "tests.bench.live_sender", clip, str(port), str(CAPTURE_FPS),
        str(int(faulty)), machines.desk_address,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, cwd=REPOSITORY,
    )  # fmt: skip
    assert sender.stdout is not None
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            begin_us = int(await sender.stdout.readline())
        yield begin_us
    finally:
        if sender.returncode is None:
            sender.kill()
        await sender.communicate()


def test_performer_on_a_lossy_link_is_held_by_friends(
    machines: Machines, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "clip.bvh").write_bytes(make_clip())
    # no secret is needed
    monkeypatch.setenv("BUNRAKU_PUBLISHED", "127.0.0.1")
    options = ("--host", "0.0.0.0", "--port", str(SERVER_PORT))
    with in_namespace(machines.venue), run_server_process(tmp_path / "data", *options) as server:
        asyncio.run(check_performance(machines, server.url, tmp_path))


async def check_performance(machines: Machines, url: str, folder: Path) -> None:
    clip, take = folder / "clip.bvh", folder / "take.bvh"
    source = Source(clip)
    address, capture = f"http://{machines.venue_address}:{SERVER_PORT}", ("vmc", "--host", "0.0.0.0", "--json")
    async with asyncio.timeout(COROUTINE_TIMEOUT_S), AsyncExitStack() as stack:
        client = await stack.enter_async_context(Client(url))
        own_stage = ("--name", "Aiko", "--server", address, str(take))
        arguments = [*capture, "--port", str(PORTS[0]), *own_stage]
        lossy = await stack.enter_async_context(run_capture(*arguments, prefix=command_in(machines.desk)))
        begin_us = await stack.enter_async_context(performing(machines, clip, PORTS[0], faulty=True))
        session = await read_stage(lossy)
        same_stage = ("--name", "Yuki", "--place", "2,0,0", "--session", f"{address}/?session={session}")
        arguments = [*capture, "--port", str(PORTS[1]), *same_stage]
        clean = await stack.enter_async_context(run_capture(*arguments, prefix=command_in(machines.desk)))
        await stack.enter_async_context(performing(machines, clip, PORTS[1], faulty=False))
        await read_stage(clean)

        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream?tracks=motion"))
        recorder = FrameRecorder(viewer)
        watching = asyncio.create_task(viewer.watch(4 * HANG_TIMEOUT_S, recorder.record, frame_interval=1 / 30))
        stack.callback(watching.cancel)
        friends = [await stack.enter_async_context(Puppeteer(client, session, name)) for name in ("Ben", "Chie")]
        async with asyncio.TaskGroup() as group:
            holding = [group.create_task(hold(*pair)) for pair in zip(friends, FRIENDS, strict=True)]
            while len(viewer.performers) < 2:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
            await wait_for_live(viewer, SETTLE_MESSAGES)
            for window in range(MAX_WINDOWS):
                try:
                    shown, clean_shown = await recorder.record_next(FRAMES)
                    times_us = np.array([*recorder.frames]) - viewer.clock.slewed_offset
                    figure, clean_figure = [track.figure for track in viewer.performers if track is not None]
                    check_smoothness(place_points(figure, shown), place_points(clean_figure, clean_shown))
                    check_held_limbs(figure, shown, times_us)
                    check_free_limbs(source, begin_us, figure, shown, times_us)
                    break
                except AssertionError:
                    if window == MAX_WINDOWS - 1:
                        raise
            await check_presence(viewer, friends)
            for task in holding:
                task.cancel()
        statistics = await stop(lossy, signal.SIGTERM)
        # the link was as bad as it should be
        assert statistics["missing"] > 0  # type: ignore[operator]
        assert statistics["duplicates"] > 0  # type: ignore[operator]
        assert (statistics["invalid"], statistics["reconnects"]) == (0, 0)
        await check_archive(client, url, str(statistics["motion"]), take, FRAMES)
        await stop(clean, signal.SIGTERM)


async def check_presence(viewer: Viewer, friends: Sequence[Puppeteer]) -> None:
    """Assert that both performers are live, and that the friends hold their limbs."""
    ben, chie = (friend.id for friend in friends)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        # on a busy machine a friend may have lost a limb, and claims it again
        while viewer.presence is None or viewer.presence.limbs != 2 * [ben, chie, ben, None]:  # noqa: ASYNC110
            await asyncio.sleep(0.05)
    assert [(live["performer"], live["name"]) for live in viewer.presence.live or ()] == [(0, "Aiko"), (1, "Yuki")]
