"""Latency of a bonded pair against that of a single limb: part `latency` of `make bench-contact`.

A real server in a separate process has two sessions whose motion stands still. In one a puppeteer holds a hand, in the
other a hand that is bonded to the free one. Each moves its hand between two targets, in turns. The latency of a pull
lasts from the input at the puppeteer's socket until an overlay with the moved hand arrives at the socket of another
viewer: of the pair, the hand that is led. Figures:

    single_p95_ms, bonded_p95_ms   p95 of the latencies
    bonded_p95_ratio               their ratio
"""

from __future__ import annotations

import asyncio
import random
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import httpx2
import numpy as np

from bunraku.client.api import Client
from bunraku.client.puppeteer import ControlRefused, Puppeteer
from bunraku.codec.motion_track import parse_motion_track
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector
from bunraku.runtime.clock import clock
from bunraku.wire.messages import Description, unpack
from tests.bench.live_stage import run_server_process
from tests.bench.session import (
    SessionRun,
    extract_hand_positions,
    open_watched_session,
    wait_until_idle,
)
from tests.servers import make_bvh_clip

PULLS = 240
"""Pulls of each session."""
PULL_INTERVAL_S = 0.4
"""Time between two pulls of a session; the hand is at rest by then."""
WARM_UP_S = 3.0
HAND_TARGETS = ((-0.25, -0.2, 0.55), (-0.25, 0.0, 0.55))
"""Targets of the left hand, arm lengths on the axes of vl5: in front of the chest, where both hands reach."""
MIN_MOVE = 0.005
"""Distance from which a hand has moved, arm lengths; the first frame of a pull moves it by 0.02."""
PULL_TIMEOUT_US = 400_000
"""Time after which a pull that no overlay shows counts as lost, µs."""


def pull_latencies_ms(frames: Sequence[tuple[int, int, Vector]], pulls_us: Sequence[int]) -> list[float]:
    """Return the time from each pull to the arrival of the first overlay that shows it; lost ones are left out.

    `frames` are arrival time, due time (µs) and position of a hand, as `extract_hand_positions` returns them.
    """
    found: list[float] = []
    at = 0
    for pull_us in pulls_us:
        while at < len(frames) and frames[at][0] < pull_us:
            at += 1
        if at == 0:
            continue
        before = frames[at - 1][2]
        moved_us = next(
            (
                arrived
                for arrived, _, position in frames[at:]
                if vector.length(vector.subtract(position, before)) > MIN_MOVE or arrived > pull_us + PULL_TIMEOUT_US
            ),
            None,
        )
        if moved_us is not None and moved_us <= pull_us + PULL_TIMEOUT_US:
            found.append((moved_us - pull_us) / 1e3)
    return found


def summarise(single_ms: Sequence[float], bonded_ms: Sequence[float]) -> dict[str, Any]:
    """Return the figures of the latencies, milliseconds."""
    single, bonded = (float(np.percentile(found, 95)) for found in (single_ms, bonded_ms))
    return {
        "single_p95_ms": round(single, 1),
        "bonded_p95_ms": round(bonded, 1),
        "bonded_p95_ratio": round(bonded / single, 3),
        "pulls_seen": [len(single_ms), len(bonded_ms)],
    }


async def _pull(client: Client, session: str, run: SessionRun, pulls: int, phase: float, is_bonded: bool) -> None:
    """Run the puppeteer of a session; `phase` is its share of the interval."""
    loop, jitter = asyncio.get_running_loop(), random.Random(session)
    async with Puppeteer(client, session) as puppeteer:

        async def hold() -> None:
            await puppeteer.claim("left_hand")
            await puppeteer.target("left_hand", *HAND_TARGETS[1])
            if is_bonded:
                await puppeteer.bond("left_hand", "right_hand")

        await hold()
        begin = loop.time() + WARM_UP_S + phase * PULL_INTERVAL_S
        for number in range(pulls):
            # the phase of the session's frames is a random one
            due = begin + number * PULL_INTERVAL_S + jitter.uniform(0.0, 1.0 / 30.0)
            await asyncio.sleep(max(due - loop.time(), 0.0))
            sent_us = clock()
            try:
                await puppeteer.target("left_hand", *HAND_TARGETS[number % 2])
            except ControlRefused:
                # the machine did not run this process for half a second
                await hold()
            else:
                run.moves_us.append(sent_us)
        await asyncio.sleep(PULL_TIMEOUT_US * 1e-6)


async def run_pulls(url: str, folder: Path, pulls: int) -> dict[str, Any]:
    """Return the figures of `pulls` pulls of each session against a server; `folder` takes the uploaded motion."""
    source = folder / "still.bvh"
    source.write_bytes(make_bvh_clip(4.0, 1))
    async with Client(url) as client:
        motion = (await client.upload(source))["id"]
        async with httpx2.AsyncClient(base_url=url) as http:
            description = unpack((await http.get(f"/v1/motions/{motion}/description")).content)
        assert isinstance(description, Description)
        figure = parse_motion_track(description.tracks[0]).figure
        sessions = [await open_watched_session(client, motion, 1) for _ in range(2)]
        for session, _ in sessions:
            await client.edit_session(session, playing=False)
        async with asyncio.TaskGroup() as tasks:
            for nth, (session, run) in enumerate(sessions):
                tasks.create_task(_pull(client, session, run, pulls, nth / 2, is_bonded=nth == 1))
    latencies: list[list[float]] = []
    for (_, run), limb in zip(sessions, (Limb.LEFT_HAND, Limb.RIGHT_HAND), strict=True):
        run.viewers[0].close()
        frames = extract_hand_positions(ArmRig(figure, limb), run.viewers[0].messages, int(limb))
        latencies.append(pull_latencies_ms(frames, run.moves_us))
    return summarise(*latencies)


def measure_latency(pulls: int = PULLS) -> dict[str, Any]:
    """Return the figures of this module; prints them."""
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder, run_server_process(Path(folder)) as server:
        wait_until_idle(server.pid)
        figures = asyncio.run(run_pulls(server.url, Path(folder), pulls))
    for key, value in figures.items():
        print(f"{key:<20}{value!s:>12}")
    return figures
