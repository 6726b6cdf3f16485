"""Live performers: `make bench-live`. The last line printed is one JSON object.

Corpus clips are replayed as real VMC packets to `bunraku capture vmc`, which streams to a server in a separate process;
the viewers decode what they receive. `--parts latency,bitrate` runs some parts, `--short` all for a shorter time.

    latency   from the capture of a pose until it is shown by another viewer, on loopback, 60 frames per second
    bitrate   of the Live messages beside bundled VMC, and the error of what is shown
    archive   the motion in the library against the take of the same capture, uploaded as a file
    narrow    a viewer behind 28.8 kbit/s and 150 ms of round trip: first pose, lag and stalls (root, Linux)
    faults    loss, duplicates, reordering and a wrong clock between tool and command: acceleration of the joints
    fanout    four live performers and 500 viewers: CPU time of the server, gaps between messages
    output    VMC sent by `bunraku send vmc`, read back by another parser

The time of each pose is found by comparing it with the source, so that the lag includes capture, server, network and
play-out. The machine must be idle: the goals are those of two cores for everything, the load included. The figures
`machine_late_ms_p99_*` show whether it was.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import numpy as np

from bunraku.client import Client, Performer, Puppeteer
from bunraku.client.datagram import DatagramSender
from bunraku.client.stage_output import VmcOutput
from bunraku.codec import live as live_codec
from bunraku.codec.skeleton_description import SkeletonDescription
from bunraku.motion.rotation import Array
from bunraku.playout.block_store import Pose
from bunraku.serve import WARM_UP_DELAY_S
from tests.bench.fanout_processes import LineProcess
from tests.bench.live_sender import bounce
from tests.bench.live_stage import (
    CAPTURE_FPS,
    PACKET_HEADER_BYTES,
    WEBSOCKET_HEADER_BYTES,
    RecordingViewer,
    Server,
    Source,
    make_viewer,
    match_poses,
    place_points,
    run_capture_process,
    run_server_process,
    watch_session,
)
from tests.bench.network import EmulatedLink, missing_requirement, open_network
from tests.datagrams import receive_datagrams
from tests.e2e.test_live import decode, wait_for_motion
from tests.output.bone_angles import max_bone_angle
from tests.output.vmc_receiver import parse_packet, receive_frame
from tests.processes import cpu_seconds

CLIPS = ("mass_dance", "perfume_A", "cmu_12_01_walk", "mass_walk")
KEYS = (
    "capture_ms_p50",
    "capture_ms_p95",
    "live_kbps_5mm",
    "archive_error_mm",
    "first_pose_ms_28k8",
    "lag_ms_p95_28k8",
    "stalls_28k8",
    "loss_accel_ratio_p99",
    "cores_4x500",
    "gap_ms_p99_4x500",
    "webcam_hand_cm_median",
    "webcam_lag_ms_p95",
    "vmc_out_deg_max",
)
"""Figures of the goals; those of the parts that did not run are null."""
SETTLE_S = 4.0
"""Time from the first pose after which delays and step sizes have settled."""
JOIN_S = 1.0
"""Time from the first live pose in which missing ones are counted apart: the blocks of the motion arrive meanwhile."""
Figures = dict[str, Any]


class Bench:
    """What the parts share."""

    def __init__(self, clips: Path, *, is_short: bool) -> None:
        self.seconds = 10.0 if is_short else 40.0
        self.is_short = is_short
        self._clips = clips

    def source(self, name: str) -> Source:
        """Return a clip."""
        return Source(self._clips / f"{name}.bvh")


async def measure_latency(bench: Bench, server: Server) -> Figures:
    """Measure the part latency."""
    source = bench.source("mass_dance")
    async with run_capture_process(server.url, source) as capture:
        viewer = make_viewer(server.url, capture.session)
        await watch_session(viewer, SETTLE_S + bench.seconds)
    match = match_shown(source, capture.begin_us, viewer)
    arrivals = [(at, message) for at, _, message in viewer.live]
    return {
        "capture_ms_p50": percentile(match.lags_ms, 50),
        "capture_ms_p95": percentile(match.lags_ms, 95),
        "capture_delay_ms": capture.statistics["delay_ms"],
        "playout_delay_ms": round(viewer.playout_delay_us / 1e3, 1),
        "live_messages_per_s": round(len(arrivals) / ((arrivals[-1][0] - arrivals[0][0]) * 1e-6), 1),
    }


def match_shown(source: Source, begin_us: int, viewer: RecordingViewer) -> Any:
    """Compare the live poses that a viewer has shown, after they have settled."""
    track = viewer.track
    assert track is not None
    start_us = viewer.first_live_us + SETTLE_S * 1e6
    shown = [(at, pose) for at, pose, is_live in viewer.shown if is_live and at >= start_us]
    points = place_points(track.figure, [pose for _, pose in shown])
    return match_poses(source, begin_us, np.array([at for at, _ in shown]), points)


async def measure_bitrate(bench: Bench, server: Server) -> Figures:
    """Measure the part bitrate."""
    kbps, with_packets, vmc, errors, coarse = [], [], [], [], []
    for name in CLIPS[:2] if bench.is_short else CLIPS:
        source = bench.source(name)
        async with run_capture_process(server.url, source) as capture:
            viewer = make_viewer(server.url, capture.session)
            await watch_session(viewer, SETTLE_S + bench.seconds / 2)
        start_us = viewer.first_live_us + SETTLE_S * 1e6
        sizes = [size for at, size, _ in viewer.live if at >= start_us]
        seconds = (viewer.live[-1][0] - start_us) * 1e-6
        kbps.append(8e-3 * sum(size + WEBSOCKET_HEADER_BYTES for size in sizes) / seconds)
        with_packets.append(kbps[-1] + 8e-3 * PACKET_HEADER_BYTES * len(sizes) / seconds)
        vmc.append(source.vmc_kbps)
        errors.append(float(np.mean(match_shown(source, capture.begin_us, viewer).errors_mm)))
        assert viewer.track is not None
        coarse.append(encode_at(source, viewer.track.skeleton, 5.0))
        print(
            f"    {name:18}{kbps[-1]:7.1f} kbit/s  {errors[-1]:5.2f} mm  VMC {vmc[-1]:6.0f} kbit/s;"
            f" coded for 5 mm {coarse[-1][0]:6.1f} kbit/s  {coarse[-1][1]:5.2f} mm",
            flush=True,
        )
    return {
        "live_kbps_5mm": geometric_mean(kbps),
        "live_error_mm": round(float(np.mean(errors)), 2),
        "live_packets_kbps": geometric_mean(with_packets),
        "vmc_kbps": geometric_mean(vmc),
        "coded_for_5mm_kbps": geometric_mean([rate for rate, _ in coarse]),
        "coded_for_5mm_error_mm": round(float(np.mean([error for _, error in coarse])), 2),
    }


def encode_at(source: Source, skeleton: SkeletonDescription, target_mm: float) -> tuple[float, float]:
    """Return bitrate with headers and mean error of a source coded by itself for a mean error."""
    target, live_codec.TARGET_ERROR_MM = live_codec.TARGET_ERROR_MM, target_mm
    try:
        encoder = live_codec.LiveEncoder(skeleton)
        encoded = [
            encoder.encode(source.roots[at : at + 2], source.rotations[at : at + 2])
            for at in range(0, len(source.roots) - 1, 2)
        ][30:]
    finally:
        live_codec.TARGET_ERROR_MM = target
    # header of the message, age and size
    size = float(np.mean([len(one.data) for one in encoded])) + 12 + WEBSOCKET_HEADER_BYTES
    return 8e-3 * size * CAPTURE_FPS / 2, float(np.mean([one.mean_error_mm for one in encoded]))


async def measure_archive(bench: Bench, server: Server) -> Figures:
    """Measure the part archive."""
    errors = []
    for name in ("mass_dance",) if bench.is_short else ("mass_dance", "perfume_A"):
        source = bench.source(name)
        with tempfile.TemporaryDirectory() as folder:
            take = Path(folder) / "take.bvh"
            async with run_capture_process(server.url, source, str(take)) as capture:
                await asyncio.sleep(min(bench.seconds, 15.0))
            async with Client(server.url) as client:
                uploaded = await client.upload(take)
                await wait_for_motion(client, capture.statistics["motion"])
                motions = [
                    await points_of_motion(client, motion) for motion in (uploaded["id"], capture.statistics["motion"])
                ]
        errors.append(compare_motions(*motions))
        print(f"    {name:18}{errors[-1]:6.3f} mm", flush=True)
    return {"archive_error_mm": round(float(np.mean(errors)), 3)}


async def points_of_motion(client: Client, motion: str) -> Array:
    """Return the positions (n, 23, 3) of a stored motion at 60 Hz, relative to the figure's own place."""
    viewer = RecordingViewer(client.socket_url(f"/v1/motions/{motion}/stream"))
    task = asyncio.create_task(viewer.watch(60.0))
    while (track := viewer.track) is None:  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    return place_points(track.figure, await decode(client, motion))


def compare_motions(uploaded: Array, archived: Array) -> float:
    """Return the mean distance in mm of an archived motion from the uploaded take, which begins before it."""
    best = float("inf")
    flat = uploaded.reshape(len(uploaded), -1)
    for shift in np.arange(0.0, 60.0 * 4, 0.05):
        at = shift + np.arange(0, len(archived), 7)
        inside = at <= len(uploaded) - 1
        if inside.sum() < len(at) / 2:
            break
        low = np.minimum(at[inside].astype(int), len(uploaded) - 2)
        part = flat[low] + (at[inside] - low)[:, None] * (flat[low + 1] - flat[low])
        apart = np.linalg.norm(part.reshape(-1, 23, 3) - archived[::7][inside], axis=-1)
        best = min(best, 1000.0 * float(apart.mean()))
    return best


async def measure_narrow(bench: Bench, server: Server, network: Any) -> Figures:
    """Measure the part narrow: the server and this thread are at the near end of the links."""
    source = bench.source("mass_dance")
    port = server.url.rpartition(":")[2]
    link = EmulatedLink(28_800, 75)
    first_ms, first_live_ms = [], []

    async with run_capture_process(server.url, source) as capture:

        async def watch(far: Any, seconds: float) -> RecordingViewer:
            viewer = make_viewer(f"http://{far.host}:{port}", capture.session, open_socket=far.open_socket)
            started_us = time.monotonic_ns() // 1000
            await watch_session(viewer, seconds)
            first_ms.append(viewer.statistics.first_pose_ms or float("inf"))
            first_live_ms.append((viewer.first_live_us - started_us) / 1e3 if viewer.first_live_us else float("inf"))
            return viewer

        await asyncio.sleep(2.0)
        for _ in range(2 if bench.is_short else 4):
            with network.open_links([link]) as (far,):
                await watch(far, 3.0)
        with network.open_links([link]) as (far,):
            long = await watch(far, 15.0 if bench.is_short else 60.0 + SETTLE_S)
            received = far.received_bytes
    match = match_shown(source, capture.begin_us, long)
    seconds = (long.live[-1][0] - long.live[0][0]) * 1e-6
    stalls, joined_us = long.stall_times_us(), long.first_live_us + JOIN_S * 1e6
    return {
        "first_pose_ms_28k8": round(float(np.median(first_ms))),
        "first_pose_worst_ms_28k8": round(max(first_ms)),
        "first_live_pose_ms_28k8": round(float(np.median(first_live_ms))),
        "lag_ms_p50_28k8": percentile(match.lags_ms, 50),
        "lag_ms_p95_28k8": percentile(match.lags_ms, 95),
        "stalls_28k8": sum(at > joined_us for at in stalls) + long.statistics.gaps,
        "stalls_at_join_28k8": sum(at <= joined_us for at in stalls),
        "narrow_messages_per_s": round(len(long.live) / seconds, 1),
        "narrow_error_mm": round(float(np.mean(match.errors_mm)), 2),
        "narrow_link_used": round(received * 8 / 28_800 / (long.statistics.seconds or 1.0), 2),
        "narrow_playout_delay_ms": round(long.playout_delay_us / 1e3, 1),
    }


async def measure_faults(bench: Bench, server: Server) -> Figures:
    """Measure the part faults: a clean and a faulty network side by side."""
    source = bench.source("mass_dance")
    async with AsyncExitStack() as stack:
        captures = [
            await stack.enter_async_context(run_capture_process(server.url, source, faulty=faulty))
            for faulty in (False, True)
        ]
        viewers = [make_viewer(server.url, capture.session) for capture in captures]
        await asyncio.gather(*(watch_session(viewer, SETTLE_S + bench.seconds) for viewer in viewers))
    clean, faulty = (joint_accelerations(viewer) for viewer in viewers)
    ratio = float(np.percentile(faulty, 99) / np.percentile(clean, 99))
    return {
        "loss_accel_ratio_p99": round(ratio, 2),
        "clean_accel_m_s2_p99": percentile(clean, 99),
        "faulty_accel_m_s2_p99": percentile(faulty, 99),
        "clean_accel_m_s2_max": round(float(clean.max()), 1),
        "faulty_accel_m_s2_max": round(float(faulty.max()), 1),
        "faulty_missing": captures[1].statistics["missing"],
        "faulty_late": captures[1].statistics["late"],
        "faulty_delay_ms": captures[1].statistics["delay_ms"],
    }


def joint_accelerations(viewer: RecordingViewer) -> Array:
    """Return the accelerations of all points, m/s^2, over consecutive live frames after the first seconds."""
    dues, points = viewer.points()
    interval = 1_000_000 / 60
    is_steady = (np.abs(dues[2:] - dues[1:-1] - interval) < 2) & (np.abs(dues[1:-1] - dues[:-2] - interval) < 2)
    is_steady &= dues[2:] > dues[0] + SETTLE_S * 1e6
    second = (points[2:] - 2.0 * points[1:-1] + points[:-2]) * 60.0**2
    found: Array = np.linalg.norm(second, axis=-1)[is_steady].ravel()
    return found


async def measure_fanout(bench: Bench, server: Server) -> Figures:
    """Measure the part fanout. The performers are in this process: capture tools would take time from the server."""
    sources = [bench.source(name) for name in ("mass_dance", "perfume_A", "mass_walk", "cmu_12_01_walk")]
    async with AsyncExitStack() as stack:
        client = await stack.enter_async_context(Client(server.url))
        session = None
        for source in sources:
            performer = await stack.enter_async_context(client.perform(source.figure, session=session))
            session = performer.session
            sending = asyncio.create_task(_send_poses(source, performer))
            stack.callback(sending.cancel)
        url = client.socket_url(f"/v1/sessions/{session}/stream?tracks=motion")
        crowd = stack.enter_context(LineProcess.start_module("fanout_crowd", url, "talk"))

        async def command(line: str) -> dict[str, Any]:
            crowd.write_line(line)
            answer: dict[str, Any] = json.loads(await asyncio.to_thread(crowd.read_line))
            return answer

        joined = await command("join 500 50")
        await asyncio.sleep(SETTLE_S)
        await command("count")
        before, begun = cpu_seconds(server.pid), time.monotonic()
        await asyncio.sleep(bench.seconds / 2)
        passed = time.monotonic() - begun
        cores = (cpu_seconds(server.pid) - before) / passed
        figures = await command("figures")
    return {
        "cores_4x500": round(cores, 2),
        "gap_ms_p99_4x500": figures["live_gap_ms_p99"],
        "late_ms_p99_4x500": figures["live_late_ms_p99"],
        "live_messages_per_s_4x500": round(figures["live_messages"] / figures["seconds"] / joined["joined"], 1),
        "viewers_4x500": joined["joined"],
        "dropped_4x500": figures["dropped"],
        "kbps_4x500": round(figures["bytes_per_second"] * 8e-3, 1),
    }


async def _send_poses(source: Source, performer: Performer) -> None:
    """Send the poses of a source at 60 frames per second."""
    begin_s, number = time.monotonic(), 0
    while True:
        at_s, frame = begin_s + number / CAPTURE_FPS, bounce(number, len(source.roots))
        await asyncio.sleep(max(at_s - time.monotonic(), 0.0))
        await performer.frame((source.roots[frame], source.rotations[frame]), at_s)
        number += 1


async def measure_output(bench: Bench, server: Server) -> Figures:
    """Measure the part output, with a controlled hand."""
    source = bench.source("mass_dance")
    angles: list[float] = []
    async with (
        run_capture_process(server.url, source) as capture,
        Client(server.url) as client,
        receive_datagrams() as receiver,
        Puppeteer(client, capture.session, "bench") as puppeteer,
    ):
        await puppeteer.claim("left_hand")
        await puppeteer.target("left_hand", 0.4, 0.3, 0.5)
        viewer = make_viewer(server.url, capture.session)
        poses: list[Pose] = []
        async with DatagramSender("127.0.0.1", receiver.port) as sender:
            output = VmcOutput(viewer, sender.send, performer=0)

            def on_frame(reference: int, pose: Pose) -> None:
                before = output.frames
                output.on_frame(reference, pose)
                if output.frames > before:
                    poses.append(pose)

            await viewer.watch(5.0 if bench.is_short else 15.0, on_frame)
        await receiver.wait_until(lambda received: len(received) >= len(poses))
        track = viewer.track
        assert track is not None
        angles = [
            max_bone_angle(receive_frame(parse_packet(datagram)), track.figure, *pose)
            for datagram, pose in zip(receiver.received, poses, strict=True)
        ]
    return {"vmc_out_deg_max": round(max(angles), 6), "vmc_out_frames": len(angles)}


PARTS: dict[str, Callable[[Bench, Server], Awaitable[Figures]]] = {
    "latency": measure_latency,
    "bitrate": measure_bitrate,
    "archive": measure_archive,
    "faults": measure_faults,
    "fanout": measure_fanout,
    "output": measure_output,
}
NAMES = ("latency", "bitrate", "archive", "narrow", "faults", "fanout", "output")


def percentile(values: Array, share: float) -> float | None:
    """Return a percentile; None without values."""
    return round(float(np.percentile(values, share)), 1) if len(values) else None


def geometric_mean(values: list[float]) -> float:
    """Return the geometric mean."""
    return round(float(np.exp(np.mean(np.log(values)))), 1)


_TIMER = """
import select, sys, time
late = []
while True:
    due = time.monotonic() + 0.01
    if select.select([sys.stdin], [], [], 0.01)[0]:
        break
    late.append(time.monotonic() - due)
late.sort()
print(1e3 * late[int(0.99 * len(late))] if late else 0.0)
"""


def run_part(name: str, bench: Bench) -> Figures:
    """Run a part, and add how late a timer of another process was: on an idle machine a fraction of a millisecond."""
    command = [sys.executable, "-c", _TIMER]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as timer:
        figures = _run_part(name, bench)
        late_ms, _ = timer.communicate()
    return {**figures, f"machine_late_ms_p99_{name}": round(float(late_ms), 1)}


def _run_part(name: str, bench: Bench) -> Figures:
    """Run a part against a server of its own."""
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        if name != "narrow":
            with run_server_process(Path(folder)) as server:
                time.sleep(WARM_UP_DELAY_S + 4.0)
                return asyncio.run(_run(PARTS[name](bench, server)))
        if (reason := missing_requirement()) is not None:
            print(f"narrow is skipped: {reason}")
            return {}
        with open_network() as network:
            options = ("--host", "0.0.0.0", "--port", "18353")
            os.environ["BUNRAKU_PUBLISHED"] = "127.0.0.1"
            with run_server_process(Path(folder), *options) as server:
                time.sleep(WARM_UP_DELAY_S + 4.0)
                return asyncio.run(_run(measure_narrow(bench, server, network)))


async def _run(figures: Awaitable[Figures]) -> Figures:
    return await figures


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--parts", default=",".join(NAMES), help=f"comma-separated parts of {', '.join(NAMES)}")
    parser.add_argument("--short", action="store_true", help="shorter runs, for a first look")
    options = parser.parse_args()
    parts = options.parts.split(",")
    if unknown := set(parts) - set(NAMES):
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    shared = Path(os.environ.get("BUNRAKU_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    clips = shared / "mocap" / "bvh"
    if not clips.is_dir():
        print(f"skipped: there is no {clips}; set BUNRAKU_SHARED to the folder of shared material")
        print(json.dumps({"skipped": "no clips"}))
        return
    bench = Bench(clips, is_short=options.short)
    figures: Figures = dict.fromkeys(KEYS)
    for name in NAMES:
        if name in parts:
            print(name, flush=True)
            found = run_part(name, bench)
            for key, value in found.items():
                print(f"    {key:<30}{value!s:>10}", flush=True)
            figures.update(found)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
