"""Latency from a puppeteer's input to other viewers' screens: `make bench-session`.

The last line printed is one JSON object. A real server in a separate process, on loopback, with several sessions of one
puppeteer and some viewers each. Each puppeteer moves its hand between two targets, a fifth of an arm length apart,
twice a second, through the control connection of the session. Each viewer receives all messages and is assumed to have
a 60 Hz screen with a random phase: a frame interpolates between the overlays around its time that had arrived by then.
The latency of a move ends with the first frame that shows the hand a hundredth of an arm length from its old position.

Messages are stored during the run and evaluated afterwards, so that the evaluation takes no CPU time from the server.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import httpx2
import numpy as np
import uvloop

from bunraku.client.api import Client
from bunraku.client.message_socket import MessageSocket
from bunraku.client.puppeteer import ControlRefused, Puppeteer
from bunraku.codec.motion_track import parse_motion_track
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Quaternion, Vector
from bunraku.motion.skeleton import Figure
from bunraku.playout.overlay_buffer import RADIANS_PER_UNIT
from bunraku.runtime.clock import clock
from bunraku.serve import WARM_UP_DELAY_S
from bunraku.wire.messages import Description, unpack
from bunraku.wire.overlay import Overlay
from tests.processes import cpu_seconds

FRAME_US = 1e6 / 60.0
WARM_UP_S = 4.0
"""Time for which limbs are controlled before the first counted move, seconds."""
SETTLE_TIMEOUT_S = 60.0
"""Maximum time until a server has loaded everything, seconds."""
MOVE_INTERVAL_S = 0.5
"""Time between two moves of a puppeteer, seconds."""
HAND_TARGETS = ((0.45, -0.2, 0.5), (0.45, 0.0, 0.5))
"""Targets of the left hand, arm lengths on the axes of vl5."""
MIN_VISIBLE_MOVE = 0.01
"""Distance from which a movement of the hand counts as visible, arm lengths."""
MOVE_TIMEOUT_US = 1_000_000
"""Time after which a move that no screen shows counts as lost, microseconds."""


class RecordingSocket(MessageSocket):
    """Connection of one viewer that stores messages with their arrival times."""

    def __init__(self, url: str) -> None:
        super().__init__(url)
        self.messages: list[tuple[int, bytes]] = []
        self._received_us = 0

    def data_received(self, data: bytes) -> None:
        self._received_us = clock()
        super().data_received(data)

    def on_message(self, message: bytes) -> None:
        self.messages.append((self._received_us, message))


@dataclass
class SessionRun:
    """One session of the run: when its puppeteer moved (clock times, µs), and what its viewers received."""

    viewers: list[RecordingSocket]
    moves_us: list[int] = field(default_factory=list)
    lost_claims: int = 0
    """Number of times that the limb was lost because its puppeteer or the server stood still for half a second."""


async def open_watched_session(client: Client, motion: str, viewers: int) -> tuple[str, SessionRun]:
    """Open one session and its viewers."""
    session = (await client.open_session(motion))["id"]
    url = client.socket_url(f"/v1/sessions/{session}/stream?rate=0")
    viewer_sockets = [RecordingSocket(url) for _ in range(viewers)]
    for viewer in viewer_sockets:
        await asyncio.wait_for(viewer.open(), 30)
    return session, SessionRun(viewer_sockets)


async def move_hand(client: Client, session: str, run: SessionRun, seconds: float, nth: int, share: float) -> None:
    """Run the puppeteer of a session; `share` is its phase in the move interval."""
    loop = asyncio.get_running_loop()
    async with Puppeteer(client, session, f"puppeteer {nth}") as puppeteer:
        await puppeteer.claim("left_hand")
        await puppeteer.target("left_hand", *HAND_TARGETS[1])
        # each puppeteer has its own phase
        await asyncio.sleep(WARM_UP_S + share * MOVE_INTERVAL_S)
        begin = loop.time()
        for number in range(int(seconds / MOVE_INTERVAL_S)):
            await asyncio.sleep(max(begin + number * MOVE_INTERVAL_S - loop.time(), 0.0))
            run.moves_us.append(clock())
            try:
                await puppeteer.target("left_hand", *HAND_TARGETS[number % 2])
            except ControlRefused:
                # the machine did not run this process for half a second: nobody sees this move
                run.lost_claims += 1
                await puppeteer.claim("left_hand")
        await asyncio.sleep(MOVE_TIMEOUT_US * 1e-6)


def extract_hand_positions(
    rig: ArmRig, messages: list[tuple[int, bytes]], hand: int = 0
) -> list[tuple[int, int, Vector]]:
    """Return arrival time, due time and position (arm lengths) of a hand in each overlay frame."""
    found: list[tuple[int, int, Vector]] = []
    for arrived, data in messages:
        if data[0] != Overlay.TYPE:
            continue
        overlay = Overlay.unpack(data)
        frames = (*overlay.earlier, overlay.limbs)
        for nth, limbs in enumerate(frames):
            if hand in limbs:
                due = overlay.due - (len(frames) - 1 - nth) * Overlay.FRAME_INTERVAL_US
                joints = [_unpack_quaternion(limbs[hand][3 * joint : 3 * joint + 3]) for joint in range(3)]
                found.append((arrived, due, rig.tip_target((joints[0], joints[1], joints[2]))))
    return found


def _unpack_quaternion(numbers: tuple[int, ...]) -> Quaternion:
    x, y, z = (number * RADIANS_PER_UNIT for number in numbers)
    return vector.from_axis_angle(vector.unit((x, y, z), (1.0, 0.0, 0.0)), vector.length((x, y, z)))


def move_latency_ms(frames: list[tuple[int, int, Vector]], move_us: int, phase: float) -> float:
    """Return the time from a move to the first frame of a screen that shows it, milliseconds; NaN if none does."""
    dues = [due for _, due, _ in frames]
    at = bisect_right(dues, move_us)
    if at == 0:
        return float("nan")
    old_position = frames[at - 1][2]
    shown = move_us + phase * FRAME_US
    while shown - move_us < MOVE_TIMEOUT_US:
        position = _position_at(frames, dues, shown)
        if vector.length(vector.subtract(position, old_position)) > MIN_VISIBLE_MOVE:
            return (shown - move_us) / 1e3
        shown += FRAME_US
    return float("nan")


def _position_at(frames: list[tuple[int, int, Vector]], dues: list[int], shown: float) -> Vector:
    """Return the hand position on a screen: interpolated between two frames, or that of the last frame that arrived."""
    after = bisect_right(dues, shown)
    # frames that have not arrived yet are not shown
    while after > 0 and after < len(frames) and frames[after][0] > shown:
        after -= 1
        if frames[after][0] <= shown:
            return frames[after][2]
    if after == 0 or after == len(frames):
        return frames[max(after - 1, 0)][2]
    (_, begin, earlier), (_, end, later) = frames[after - 1], frames[after]
    share = (shown - begin) / (end - begin)
    return vector.add(earlier, vector.scale(vector.subtract(later, earlier), share))


def wait_until_idle(pid: int) -> None:
    """Wait until a server that has just started has loaded everything and is idle."""
    end = time.monotonic() + SETTLE_TIMEOUT_S
    # loading starts shortly after the server answers
    time.sleep(WARM_UP_DELAY_S + 1.0)
    before = cpu_seconds(pid)
    while time.monotonic() < end:
        time.sleep(1.0)
        now = cpu_seconds(pid)
        if now - before < 0.1:
            return
        before = now
    print(f"the server was still busy after {SETTLE_TIMEOUT_S:g} s", file=sys.stderr)


async def run_sessions(url: str, pid: int, sessions: int, viewers: int, seconds: float) -> dict[str, float]:
    """Run the benchmark against a server and return the figures."""
    async with Client(url) as client:
        motion = (await client.motions())[0]["id"]
        async with httpx2.AsyncClient(base_url=url) as http:
            description = unpack((await http.get(f"/v1/motions/{motion}/description")).content)
        assert isinstance(description, Description)
        figure: Figure = parse_motion_track(description.tracks[0]).figure
        watched_sessions = [await open_watched_session(client, motion, viewers) for _ in range(sessions)]
        before, begun, own_cores = cpu_seconds(pid), time.perf_counter(), time.process_time()
        async with asyncio.TaskGroup() as tasks:
            for nth, (session, run) in enumerate(watched_sessions):
                tasks.create_task(move_hand(client, session, run, seconds, nth, nth / sessions))
        runs = [run for _, run in watched_sessions]
        passed = time.perf_counter() - begun
        server_cores, own_cores = (cpu_seconds(pid) - before) / passed, (time.process_time() - own_cores) / passed
    rig = ArmRig(figure, Limb.LEFT_HAND)
    random = np.random.default_rng(1)
    latencies_ms: list[float] = []
    lateness_ms: list[float] = []
    gaps: list[float] = []
    messages = 0
    for run in runs:
        for viewer in run.viewers:
            assert not viewer.closed, "a viewer was dropped"
            frames = extract_hand_positions(rig, viewer.messages)
            messages += sum(data[0] == Overlay.TYPE for _, data in viewer.messages)
            lateness_ms += [(arrived - due) / 1e3 for arrived, due, _ in frames]
            gaps += [(b[1] - a[1]) / 1e3 for a, b in pairwise(frames)]
            latencies_ms += [move_latency_ms(frames, move_us, float(random.random())) for move_us in run.moves_us]
    measured = np.array([latency for latency in latencies_ms if latency == latency])
    return {
        "sessions": sessions,
        "viewers": sessions * viewers,
        "pulls": len(latencies_ms),
        "lost": len(latencies_ms) - len(measured),
        "limbs_lost": sum(run.lost_claims for run in runs),
        "input_to_screen_ms_p50": round(float(np.percentile(measured, 50)), 1),
        "input_to_screen_ms_p95": round(float(np.percentile(measured, 95)), 1),
        "input_to_screen_ms_p99": round(float(np.percentile(measured, 99)), 1),
        "overlays_late_share": round(float(np.mean(np.array(lateness_ms) > 0.0)), 4),
        "overlay_frame_ms_p99": round(float(np.percentile(gaps, 99)), 1),
        "messages_per_s": round(messages / seconds),
        "server_cores": round(server_cores, 2),
        "screens_cores": round(own_cores, 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--sessions", type=int, default=50)
    parser.add_argument("--viewers", type=int, default=10, help="viewers per session")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    bunraku = Path(sys.executable).parent / "bunraku"
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        server = subprocess.Popen(
            [bunraku, "up", "--demo", "--port", "0", "--data", folder],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200"},
        )
        assert server.stdout is not None
        try:
            url = next(found[1] for line in server.stdout if (found := re.search(r"is at (http://\S+)/", line)))
            print(f"{options.sessions} sessions of one puppeteer and {options.viewers} viewers, {options.seconds:g} s")
            wait_until_idle(server.pid)
            # garbage collection would walk the stored messages and stall the viewers
            gc.disable()
            figures = uvloop.run(run_sessions(url, server.pid, options.sessions, options.viewers, options.seconds))
        finally:
            server.terminate()
            server.wait(20)
    for name, value in figures.items():
        print(f"{name:<26}{value:>10}")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
