"""Server, capture tools and viewers of `live.py`, and the comparison of what is shown with what was captured."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bunraku.capture.calibration import calibrate
from bunraku.capture.retarget import Retargeter
from bunraku.capture.session import CALIBRATION_S
from bunraku.capture.vmc import VmcAssembler
from bunraku.client import Client, Viewer
from bunraku.client.viewer import FRAME_INTERVAL_S
from bunraku.codec.live import LiveTrack
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure, joint_and_tip_positions
from bunraku.playout.block_store import Pose
from bunraku.wire.live import Live
from bunraku.wire.messages import unpack
from tests.bench.live_sender import add_time, bounce, make_bundles
from tests.processes import free_port
from tests.time_limit import HANG_TIMEOUT_S

BUNRAKU = Path(sys.executable).parent / "bunraku"
CAPTURE_FPS = 60.0
MAX_LAG_US = 900_000
LAG_STEP_US = 2_000
MIN_SPEED_M_S = 0.25
"""Mean speed of the points from which the lag of a pose can be told from the pose."""
WEBSOCKET_HEADER_BYTES = 2
PACKET_HEADER_BYTES = 52
"""Headers of TCP, with time stamps, and IPv4."""


class Server(NamedTuple):
    """Server process."""

    url: str
    pid: int


@contextmanager
def run_server_process(folder: Path, *options: str) -> Iterator[Server]:
    """Run `bunraku up` in a process."""
    command = [str(BUNRAKU), "up", "--data", str(folder), *(options or ("--port", "0"))]
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        try:
            url = next(found[1] for line in process.stdout if (found := re.search(r"is at (http://\S+)/", line)))
            yield Server(url, process.pid)
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(HANG_TIMEOUT_S)
            process.kill()


class Source:
    """Clip as a capture tool sends it, and its poses as they are calibrated and retargeted."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.bundles = make_bundles(path, CAPTURE_FPS)
        assembler = VmcAssembler()
        calibrating = round(CALIBRATION_S * CAPTURE_FPS) + 1
        captured = [
            frame
            for number in range(max(calibrating, len(self.bundles)))
            for frame in assembler.feed(add_time(self.bundles[bounce(number, len(self.bundles))], number / CAPTURE_FPS))
        ]
        retargeter = Retargeter(calibrate(VmcAssembler.skeleton, captured[:calibrating]))
        poses = [retargeter.retarget(frame) for frame in captured[: len(self.bundles)]]
        self.roots = np.array([pose.root for pose in poses])
        self.rotations = np.array([pose.rotations for pose in poses])
        self.figure = retargeter.figure
        self.points = joint_and_tip_positions(self.figure, self.roots, self.rotations)
        self.vmc_kbps = (
            float(np.mean([len(add_time(bundle, 0.0)) + 28 for bundle in self.bundles])) * 8e-3 * CAPTURE_FPS
        )
        """Bitrate of its bundles with the headers of UDP and IP."""

    def points_at(self, frames: Array) -> Array:
        """Return the positions (..., 23, 3) at frame numbers of the clip that runs forth and back."""
        period = 2 * len(self.points) - 2
        phase = frames % period
        at = np.where(phase < len(self.points) - 1, phase, period - phase)
        low = np.minimum(at.astype(int), len(self.points) - 2)
        share = (at - low)[..., None, None]
        found: Array = self.points[low] + share * (self.points[low + 1] - self.points[low])
        return found


class Match(NamedTuple):
    """Comparison of shown poses with the source."""

    lags_ms: Array
    """Time from the capture of the pose that is shown, of poses in movement."""
    errors_mm: Array
    """Mean distance of the points from those of that pose."""


class RecordingViewer(Viewer):
    """Viewer that records the shown poses, and the Live messages."""

    def __init__(self, url: str, **options: Any) -> None:
        super().__init__(url, **options)
        self.shown: list[tuple[int, Pose, bool]] = []
        """Time of `time.monotonic`, in microseconds, pose, and whether it is a live one, at each picture."""
        self.live: list[tuple[int, int, Live]] = []
        """Time of the arrival, size and content of the Live messages."""

    def _on_message(self, data: bytes) -> None:
        if data and data[0] == Live.TYPE and isinstance(message := unpack(data), Live):
            self.live.append((time.monotonic_ns() // 1000, len(data), message))
        super()._on_message(data)

    def record(self, reference: int, pose: Pose) -> None:
        """Record a picture."""
        buffer = self._live.get(0)
        is_live = buffer is not None and buffer.pose_at(reference) is not None
        self.shown.append((time.monotonic_ns() // 1000, pose, is_live))

    @property
    def playout_delay_us(self) -> float:
        """Delay behind the reference clock at the last picture."""
        return self._delay.at(self.shown[-1][0])

    @property
    def first_live_us(self) -> int:
        """Time of the first picture with a live pose; 0 without one."""
        return next((at for at, _, is_live in self.shown if is_live), 0)

    def stall_times_us(self) -> list[int]:
        """Return the times, after the first live pose, at which the live pose was missing again."""
        return [at for (_, _, before), (at, _, after) in pairwise(self.shown) if before and not after]

    def points(self, performer: int = 0) -> tuple[Array, Array]:
        """Return the due times (n,) and positions (n, 23, 3) of all live frames, in order."""
        track = self.performers[performer]
        assert track is not None
        live_track, frames = LiveTrack(track.skeleton), dict[int, Pose]()
        for _, _, message in self.live:
            if performer not in message.blocks:
                continue
            steps = np.arange(message.frames, dtype=np.float64)
            roots, rotations = live_track.decode(message.frames, message.blocks[performer].data).pose_at(steps)
            for nth in range(message.frames):
                due = message.due - (message.frames - 1 - nth) * Live.FRAME_INTERVAL_US
                frames[due] = roots[nth], rotations[nth]
        dues = sorted(frames)
        return np.array(dues), place_points(track.figure, [frames[due] for due in dues])


def place_points(figure: Figure, poses: list[Pose]) -> Array:
    """Return the positions (n, 23, 3) of joints and tips."""
    points: Array = joint_and_tip_positions(
        figure, np.array([root for root, _ in poses]), np.array([rotations for _, rotations in poses])
    )
    return points


def match_poses(source: Source, begin_us: int, times_us: Array, points: Array) -> Match:
    """Compare positions (n, 23, 3) at times of `time.monotonic` with the source, up to `MAX_LAG_US` before.

    Each pose is compared with the nearest of the source's, so that its lag is known where the body moves.
    """
    lags = np.arange(0, MAX_LAG_US, LAG_STEP_US)
    found, errors = [], []
    for at, place in zip(times_us, points, strict=True):
        frames = (at - lags - begin_us) * 1e-6 * CAPTURE_FPS
        candidates = source.points_at(frames)
        distances = np.linalg.norm(candidates - place, axis=-1).mean(axis=-1)
        best = int(distances.argmin())
        errors.append(1000.0 * distances[best])
        speed = np.linalg.norm(candidates[best] - source.points_at(frames[best] - 1.0), axis=-1).mean() * CAPTURE_FPS
        # poses about a turn of the clip occur twice
        has_turn = frames[-1] // (len(source.points) - 1) != frames[0] // (len(source.points) - 1)
        if speed > MIN_SPEED_M_S and not has_turn:
            found.append(lags[best] / 1e3)
    return Match(np.array(found), np.array(errors))


@dataclass
class Capture:
    """Running `bunraku capture vmc` with its capture tool."""

    session: str
    begin_us: int
    """Time of the first frame on `time.monotonic`."""
    process: asyncio.subprocess.Process
    statistics: dict[str, Any] = field(default_factory=dict)
    """What the command printed at its end."""


@asynccontextmanager
async def run_capture_process(
    url: str, source: Source, *arguments: str, faulty: bool = False
) -> AsyncIterator[Capture]:
    """Stream a source to a server; the performance ends with the block."""
    port = free_port()
    process = await asyncio.create_subprocess_exec(
        BUNRAKU, "capture", "vmc", *arguments, "--server", url, "--port", str(port), "--json",
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    assert process.stderr is not None
    await process.stderr.readline()
    sender = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tests.bench.live_sender", str(source.path), str(port), str(CAPTURE_FPS),
        str(int(faulty)), stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
    )  # fmt: skip
    assert sender.stdout is not None
    try:
        begin_us = int(await sender.stdout.readline())
        line = (await process.stderr.readline()).decode()
        found = re.search(r"session=(\S+)", line)
        if found is None:
            raise RuntimeError(f"the capture does not stream: {line}")
        capture = Capture(found[1], begin_us, process)
        yield capture
        process.terminate()
        output, _ = await process.communicate()
        capture.statistics = json.loads(output)
    finally:
        for one in (process, sender):
            if one.returncode is None:
                one.kill()
                await one.wait()


async def watch_session(viewer: RecordingViewer, seconds: float) -> None:
    """Watch for a time."""
    await viewer.watch(seconds, viewer.record, frame_interval=FRAME_INTERVAL_S)


def make_viewer(url: str, session: str, **options: Any) -> RecordingViewer:
    """Create a viewer of a session."""
    return RecordingViewer(Client(url).socket_url(f"/v1/sessions/{session}/stream?tracks=motion"), **options)
