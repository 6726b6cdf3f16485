"""How soon a pull is on the others' screens: `make bench-session`. The last line printed is one JSON object.

A real server in a process of its own, on loopback: some sessions, each of one puppeteer and some viewers, for some
seconds. Each puppeteer asks its hand from one place to another, a fifth of an arm away, twice a second, through the
session's control socket. Each viewer takes in what comes, and is taken to have a screen of 60 frames a second, in a
phase of its own: a frame shows the overlays between which its time lies, of those that had come by then. A pull is on
the screen with the first frame that shows the hand a hundredth of an arm from where it stood.

What the viewers receive is kept, and looked at when all is over, so that looking costs the server nothing.
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
"""Seconds that limbs are held before the first pull that counts."""
SETTLE_TIMEOUT_S = 60.0
"""Seconds that a server is waited for at most, until it has loaded all it needs."""
MOVE_INTERVAL_S = 0.5
"""Seconds between two pulls of a puppeteer."""
HAND_TARGETS = ((0.45, -0.2, 0.5), (0.45, 0.0, 0.5))
"""Where a left hand is asked to be, arm lengths on the axes of vl5."""
MIN_VISIBLE_MOVE = 0.01
"""Arm lengths from where it stood: the hand is seen to move."""
MOVE_TIMEOUT_US = 1_000_000
"""Microseconds: a pull that nobody saw by then is lost."""


class RecordingSocket(MessageSocket):
    """One viewer's socket: messages are kept with the clock time at which they came."""

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
    """One session of the run: when its puppeteer pulled (clock times, µs), and what its viewers received."""

    viewers: list[RecordingSocket]
    moves_us: list[int] = field(default_factory=list)
    lost_claims: int = 0
    """Times that the limb was lost, its puppeteer or the server having stood still for half a second."""


async def open_watched_session(client: Client, motion: str, viewers: int) -> tuple[str, SessionRun]:
    """One session with its viewers."""
    session = (await client.open_session(motion))["id"]
    url = client.socket_url(f"/v1/sessions/{session}/stream?rate=0")
    screens = [RecordingSocket(url) for _ in range(viewers)]
    for screen in screens:
        await asyncio.wait_for(screen.open(), 30)
    return session, SessionRun(screens)


async def move_hand(client: Client, session: str, run: SessionRun, seconds: float, nth: int, share: float) -> None:
    """The puppeteer of a session, from its coming to its going; `share` of a beat after the others."""
    loop = asyncio.get_running_loop()
    async with Puppeteer(client, session, f"puppeteer {nth}") as puppeteer:
        await puppeteer.claim("left_hand")
        await puppeteer.target("left_hand", *HAND_TARGETS[1])
        # each in its own beat
        await asyncio.sleep(WARM_UP_S + share * MOVE_INTERVAL_S)
        begin = loop.time()
        for number in range(int(seconds / MOVE_INTERVAL_S)):
            await asyncio.sleep(max(begin + number * MOVE_INTERVAL_S - loop.time(), 0.0))
            run.moves_us.append(clock())
            try:
                await puppeteer.target("left_hand", *HAND_TARGETS[number % 2])
            except ControlRefused:
                # half a second went by in which this machine had no time for it: that pull nobody sees
                run.lost_claims += 1
                await puppeteer.claim("left_hand")
        await asyncio.sleep(MOVE_TIMEOUT_US * 1e-6)


def extract_hand_positions(rig: ArmRig, messages: list[tuple[int, bytes]]) -> list[tuple[int, int, Vector]]:
    """Each overlay frame that came: when it came, when it was due, and where it has the left hand, arm lengths."""
    found: list[tuple[int, int, Vector]] = []
    for came, data in messages:
        if data[0] != Overlay.TYPE:
            continue
        overlay = Overlay.unpack(data)
        frames = (*overlay.earlier, overlay.limbs)
        for nth, limbs in enumerate(frames):
            if 0 in limbs:
                due = overlay.due - (len(frames) - 1 - nth) * Overlay.FRAME_INTERVAL_US
                joints = [_unpack_quaternion(limbs[0][3 * joint : 3 * joint + 3]) for joint in range(3)]
                found.append((came, due, rig.tip_target((joints[0], joints[1], joints[2]))))
    return found


def _unpack_quaternion(numbers: tuple[int, ...]) -> Quaternion:
    x, y, z = (number * RADIANS_PER_UNIT for number in numbers)
    return vector.from_axis_angle(vector.unit((x, y, z), (1.0, 0.0, 0.0)), vector.length((x, y, z)))


def move_latency_ms(frames: list[tuple[int, int, Vector]], move_us: int, phase: float) -> float:
    """Milliseconds from a pull to the first frame of a screen that shows the hand moving; NaN where none does."""
    dues = [due for _, due, _ in frames]
    at = bisect_right(dues, move_us)
    if at == 0:
        return float("nan")
    stood = frames[at - 1][2]
    shown = move_us + phase * FRAME_US
    while shown - move_us < MOVE_TIMEOUT_US:
        place = _position_at(frames, dues, shown)
        if vector.length(vector.subtract(place, stood)) > MIN_VISIBLE_MOVE:
            return (shown - move_us) / 1e3
        shown += FRAME_US
    return float("nan")


def _position_at(frames: list[tuple[int, int, Vector]], dues: list[int], shown: float) -> Vector:
    """Where a screen has the hand at a time: between the two frames that lie about it, or at the last that came."""
    after = bisect_right(dues, shown)
    # what has not come yet is not shown
    while after > 0 and after < len(frames) and frames[after][0] > shown:
        after -= 1
        if frames[after][0] <= shown:
            return frames[after][2]
    if after == 0 or after == len(frames):
        return frames[max(after - 1, 0)][2]
    (_, begin, one), (_, end, other) = frames[after - 1], frames[after]
    share = (shown - begin) / (end - begin)
    return vector.add(one, vector.scale(vector.subtract(other, one), share))


def wait_until_idle(pid: int) -> None:
    """Waits until a server that has just begun has loaded what it needs, and has nothing more to do."""
    end = time.monotonic() + SETTLE_TIMEOUT_S
    # it begins to load a little after it answers
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
    """The run, and its figures."""
    async with Client(url) as client:
        motion = (await client.motions())[0]["id"]
        async with httpx2.AsyncClient(base_url=url) as plain:
            description = unpack((await plain.get(f"/v1/motions/{motion}/description")).content)
        assert isinstance(description, Description)
        figure: Figure = parse_motion_track(description.tracks[0]).figure
        stages = [await open_watched_session(client, motion, viewers) for _ in range(sessions)]
        before, begun, own = cpu_seconds(pid), time.perf_counter(), time.process_time()
        async with asyncio.TaskGroup() as pulling:
            for nth, (session, one) in enumerate(stages):
                pulling.create_task(move_hand(client, session, one, seconds, nth, nth / sessions))
        played = [one for _, one in stages]
        passed = time.perf_counter() - begun
        busy, own = (cpu_seconds(pid) - before) / passed, (time.process_time() - own) / passed
    rig = ArmRig(figure, Limb.LEFT_HAND)
    random = np.random.default_rng(1)
    delays: list[float] = []
    late: list[float] = []
    gaps: list[float] = []
    messages = 0
    for one in played:
        for screen in one.viewers:
            assert not screen.closed, "a viewer was dropped"
            frames = extract_hand_positions(rig, screen.messages)
            messages += sum(data[0] == Overlay.TYPE for _, data in screen.messages)
            late += [(came - due) / 1e3 for came, due, _ in frames]
            gaps += [(b[1] - a[1]) / 1e3 for a, b in pairwise(frames)]
            delays += [move_latency_ms(frames, pull, float(random.random())) for pull in one.moves_us]
    known = np.array([delay for delay in delays if delay == delay])
    return {
        "sessions": sessions,
        "viewers": sessions * viewers,
        "pulls": len(delays),
        "lost": len(delays) - len(known),
        "limbs_lost": sum(one.lost_claims for one in played),
        "input_to_screen_ms_p50": round(float(np.percentile(known, 50)), 1),
        "input_to_screen_ms_p95": round(float(np.percentile(known, 95)), 1),
        "input_to_screen_ms_p99": round(float(np.percentile(known, 99)), 1),
        "overlays_late_share": round(float(np.mean(np.array(late) > 0.0)), 4),
        "overlay_frame_ms_p99": round(float(np.percentile(gaps, 99)), 1),
        "messages_per_s": round(messages / seconds),
        "server_cores": round(busy, 2),
        "screens_cores": round(own, 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--sessions", type=int, default=50)
    parser.add_argument("--viewers", type=int, default=10, help="of each session")
    parser.add_argument("--seconds", type=float, default=20.0)
    given = parser.parse_args()
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
            print(f"{given.sessions} sessions of one puppeteer and {given.viewers} viewers, {given.seconds:g} s")
            wait_until_idle(server.pid)
            # what is kept for later is not walked through meanwhile: that would stop the screens' clocks
            gc.disable()
            figures = uvloop.run(run_sessions(url, server.pid, given.sessions, given.viewers, given.seconds))
        finally:
            server.terminate()
            server.wait(20)
    for name, value in figures.items():
        print(f"{name:<26}{value:>10}")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
