"""Streaming over constrained links: `make bench-narrow`. The last line printed is one JSON object.

A real server in a separate process at the near end of emulated links (`network.py`), headless viewers at their far
ends, kernel TCP between. Needs root; `--only 28k8,live` runs some cases, for example `make bench-narrow
ARGUMENTS="--only live"`.

    9k6 28k8 56k   a motion at these kbit/s (RTT 300, 150, 150 ms): time from the start of the TCP connection to the
                   first pose (median of five links side by side), and gaps over 60 s on one of them
    audio          the same links with all tracks of the demo: music, camera and lights; also the share of the last 30 s
                   that had sound, and its last bitrate level
    steps          56 -> 14.4 -> 56 kbit/s while a performer is controlled: gaps, latency of the live overlay
    live           all four limbs controlled, at 28.8 kbit/s: latency, utilisation of the link, and the same with naive
                   writing of each overlay
    proxied        the same session and link, with a proxy between server and link: latency, and utilisation
    clock          the same link, with a viewer's clock that is right, and one that is an hour off and 200 ppm fast
    join           joining a running session at 64 kbit/s: the pose, and the difference to a viewer on an unconstrained
                   link
    cut            28.8 kbit/s with an outage of 25 s: playback afterwards
    traces         18 recorded 3G links at a mean of 28.8 and of 56 kbit/s: stalls against the lowest bitrate level, and
                   the mean bitrate shown against the best constant one of an oracle

Except for `audio`, viewers request only the motion. The latency of an overlay is the time from the computation of its
newest frame to its arrival. Both ends share one kernel clock, so a viewer's true clock offset is known.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

from bunraku.client.api import Client
from bunraku.codec import motion_decoder
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import Pose
from tests.bench.naive_relay import naive_relay
from tests.bench.narrow_traces import measure_traces
from tests.bench.narrow_viewer import (
    LINKS,
    SERVER_PORT,
    BenchContext,
    Figures,
    MeasuringViewer,
    NonReconnectingViewer,
    measure_clock_offset,
    percentile,
    round_finite,
)
from tests.bench.network import EmulatedLink, EmulatedNetwork, FarEnd, missing_requirement, open_network
from tests.reverse_proxy import run_reverse_proxy


async def measure_first_pose(bench: BenchContext, only: set[str]) -> Figures:
    """Measure the cases 9k6, 28k8 and 56k."""
    cases = [name for name in LINKS if name in only]
    figures: Figures = {}
    with bench.network.open_links([LINKS[name] for name in cases for _ in range(5)]) as fars:
        viewers = [bench.create_motion_viewer(far, "?tracks=motion") for far in fars]
        # the first viewer of each case stays; they start one after the other, as they share two cores
        watching = []
        for nth in range(5):
            for case in range(len(cases)):
                viewer = viewers[5 * case + nth]
                watching.append(asyncio.create_task(viewer.watch_and_measure(60.0 if nth == 0 else 4.0)))
                await asyncio.sleep(0.7)
        await asyncio.gather(*watching)
        for case, name in enumerate(cases):
            case_viewers = viewers[5 * case : 5 * case + 5]
            first = [viewer.statistics.first_pose_ms or float("inf") for viewer in case_viewers]
            figures[f"first_pose_ms_{name}"] = round_finite(float(np.median(first)))
            figures[f"first_pose_worst_ms_{name}"] = round_finite(max(first))
            figures[f"stalls_{name}"] = sum(viewer.statistics.gaps for viewer in case_viewers)
            figures[f"shown_kbps_{name}"] = round(case_viewers[0].statistics.shown_kbps, 2)
            figures[f"line_kbps_{name}"] = round(fars[5 * case].received_bytes * 8e-3 / 60.0, 2)
    return figures


async def measure_audio(bench: BenchContext) -> Figures:
    """Measure the case audio."""
    figures: Figures = {}
    with bench.network.open_links(list(LINKS.values())) as fars:
        viewers = [bench.create_motion_viewer(far) for far in fars]
        watching = []
        for viewer in viewers:
            watching.append(asyncio.create_task(viewer.watch_and_measure(60.0)))
            await asyncio.sleep(0.7)
        await asyncio.gather(*watching)
        for name, viewer, far in zip(LINKS, viewers, fars, strict=True):
            had_sound = [
                available
                for (at, _, _), available in zip(viewer.shown, viewer.audio_available, strict=True)
                if at > viewer.started_us + 30e6
            ]
            figures[f"audio_first_pose_ms_{name}"] = round_finite(viewer.statistics.first_pose_ms or float("inf"))
            figures[f"audio_stalls_{name}"] = viewer.statistics.gaps
            figures[f"audio_share_{name}"] = round(float(np.mean(had_sound)), 3)
            figures[f"audio_rate_{name}"] = viewer.statistics.audio_rate
            figures[f"audio_shown_kbps_{name}"] = round(viewer.statistics.shown_kbps, 2)
            figures[f"audio_line_kbps_{name}"] = round(far.received_bytes * 8e-3 / 60.0, 2)
    return figures


async def measure_proxied(bench: BenchContext) -> Figures:
    """Measure the case proxied; the proxy is at the near end."""
    figures: Figures = {}
    seconds, settle = 40.0, 5.0

    async def work(session: str) -> None:
        async with run_reverse_proxy(SERVER_PORT, host="0.0.0.0", listen_port=SERVER_PORT + 2):
            with bench.network.open_links([EmulatedLink(28_800, 75, queue_bytes=64_000)]) as (far,):
                viewer = MeasuringViewer(
                    f"ws://{far.host}:{SERVER_PORT + 2}/v1/sessions/{session}/stream?tracks=motion",
                    far,
                    bench.true_clock_offset_us,
                )
                await viewer.watch_and_measure(seconds)
                overlay_ages = [ms for at, ms, _ in viewer.overlay_arrivals if at - viewer.started_us > settle * 1e6]
                figures["proxied_p50_ms_28k8"] = round(percentile(overlay_ages, 50))
                figures["proxied_p95_ms_28k8"] = round(percentile(overlay_ages, 95))
                figures["proxied_fps_28k8"] = round(len(overlay_ages) / (seconds - settle), 1)
                figures["proxied_stalls_28k8"] = viewer.statistics.gaps
                figures["proxied_line_used_28k8"] = round(far.received_bytes * 8 / 28_800 / seconds, 3)

    await bench.run_controlled(work, 5.0)
    return figures


async def measure_rate_steps(bench: BenchContext) -> Figures:
    """Measure the case steps."""
    figures: Figures = {}

    async def work(session: str) -> None:
        with bench.network.open_links([EmulatedLink(56_000, 75, bitrate_steps="10:14400,18:56000")]) as (far,):
            begun = time.monotonic_ns() // 1000
            viewer = bench.create_viewer(far, f"/v1/sessions/{session}/stream?tracks=motion")
            await viewer.watch_and_measure(26.0)

        def overlay_ages(begin: float, end: float) -> list[float]:
            return [ms for at, ms, _ in viewer.overlay_arrivals if begin * 1e6 <= at - begun < end * 1e6]

        def rate(begin: float, end: float) -> float:
            return sum(frames for at, _, frames in viewer.overlay_arrivals if begin * 1e6 <= at - begun < end * 1e6) / (
                end - begin
            )

        figures["steps_stalls"] = viewer.statistics.gaps
        figures["steps_peak_ms"] = round(max(overlay_ages(4, 26)))
        figures["steps_after_1500_ms"] = round(percentile(overlay_ages(11.5, 18), 95))
        figures["steps_fps_56k"] = round(rate(4, 10), 1)
        figures["steps_fps_14k4"] = round(rate(11.5, 18), 1)
        figures["steps_fps_back"] = round(rate(20, 26), 1)

    await bench.run_controlled(work)
    return figures


async def measure_live(bench: BenchContext) -> Figures:
    """Measure the cases live and clock: one link ours, one naive, one with a wrong viewer clock."""
    figures: Figures = {}
    seconds, settle = 60.0, 5.0

    async def work(session: str) -> None:
        path = f"/v1/sessions/{session}/stream?tracks=motion"
        link = EmulatedLink(28_800, 75, queue_bytes=64_000)
        async with naive_relay(f"ws://127.0.0.1:{SERVER_PORT}{path}", SERVER_PORT + 1):
            with bench.network.open_links([link] * 3) as fars:
                ours, naive = (
                    bench.create_viewer(fars[0], path),
                    NonReconnectingViewer(
                        f"ws://{fars[1].host}:{SERVER_PORT + 1}/", fars[1], bench.true_clock_offset_us
                    ),
                )
                wrong_clock = bench.create_viewer(
                    fars[2], path, local_clock=lambda: round(time.monotonic_ns() * 1.0002e-3) + 3_600_000_000
                )
                transferred = 0

                async def count() -> None:
                    nonlocal transferred
                    await asyncio.sleep(settle)
                    before = fars[0].received_bytes
                    await asyncio.sleep(seconds - settle - 1.0)
                    transferred = fars[0].received_bytes - before

                await asyncio.gather(
                    ours.watch_and_measure(seconds),
                    naive.watch_and_measure(seconds),
                    wrong_clock.watch_and_measure(seconds),
                    count(),
                )
        begun = ours.overlay_arrivals[0][0] + settle * 1e6
        arrivals = [(ms, frames) for at, ms, frames in ours.overlay_arrivals if at > begun]
        lateness = [ms for ms, _ in arrivals]
        naive_ages = [ms for at, ms, _ in naive.overlay_arrivals if at > begun]
        span = (ours.overlay_arrivals[-1][0] - begun) / 1e6
        figures["live_p50_ms_28k8"] = round(percentile(lateness, 50))
        figures["live_p95_ms_28k8"] = round(percentile(lateness, 95))
        figures["live_fps_28k8"] = round(sum(frames for _, frames in arrivals) / span, 1)
        figures["live_messages_28k8"] = round(len(arrivals) / span, 1)
        figures["live_line_used_28k8"] = round(transferred * 8 / (seconds - settle - 1.0) / link.bitrate, 3)
        figures["live_stalls_28k8"] = ours.statistics.gaps
        figures["live_shown_kbps_28k8"] = round(ours.statistics.shown_kbps, 2)
        figures["naive_p95_ms_28k8"] = round(percentile(naive_ages, 95))
        figures["times_naive"] = round(percentile(naive_ages, 95) / percentile(lateness, 95), 1)
        for name, viewer in (("clock", ours), ("clock_off", wrong_clock)):
            # the first second may use the estimate from the Welcome message
            errors = np.abs(viewer.clock_errors[60:])
            figures[f"{name}_median_ms"] = round(percentile(errors, 50), 2)
            figures[f"{name}_p95_ms"] = round(percentile(errors, 95), 2)

    # fast movement, so that the session sends all frames: of slow movement it sends every second one
    await bench.run_controlled(work, 5.0)
    return figures


async def measure_join(bench: BenchContext) -> Figures:
    """Measure the case join."""
    figures: Figures = {}

    async def work(session: str) -> None:
        path = f"/v1/sessions/{session}/stream?tracks=motion"
        with bench.network.open_links([EmulatedLink(64_000, 50)]) as (far,):
            reference_viewer = MeasuringViewer(f"ws://127.0.0.1:{SERVER_PORT}{path}", None, bench.true_clock_offset_us)
            watching = asyncio.create_task(reference_viewer.watch_and_measure(8.0))
            await asyncio.sleep(4.0)
            joining_viewer = bench.create_viewer(far, path)
            differences_mm: list[float] = []

            def compare_poses(at: int, pose: Pose) -> None:
                other = reference_viewer.pose_at(at)
                if other is not None and joining_viewer.track is not None:
                    own_points, reference_points = (
                        joint_and_tip_positions(joining_viewer.track.figure, *one) for one in (pose, other)
                    )
                    differences_mm.append(float(np.linalg.norm(own_points - reference_points, axis=-1).max()) * 1e3)

            await joining_viewer.watch(4.0, compare_poses)
            await watching
            now = time.monotonic_ns() // 1000
            figures["join_first_pose_ms_64k"] = round_finite(joining_viewer.statistics.first_pose_ms or float("inf"))
            figures["join_apart_mm_p95"] = round(percentile(differences_mm[60:], 95), 1)
            figures["join_clock_apart_ms"] = round(
                abs(joining_viewer.clock.at(now) - reference_viewer.clock.at(now)) / 1e3, 2
            )

    await bench.run_controlled(work)
    return figures


async def measure_outage(bench: BenchContext) -> Figures:
    """Measure the case cut."""
    figures: Figures = {}
    begin, end = 8.0, 33.0
    with bench.network.open_links([EmulatedLink(28_800, 75, outage_s=(begin, end))]) as (far,):
        viewer = bench.create_motion_viewer(far, "?tracks=motion")
        before = time.monotonic_ns() // 1000
        received: list[int] = []
        await asyncio.gather(
            viewer.watch_and_measure(45.0),
            _sample_received_bytes(far, end - 1.0, received),
            _sample_received_bytes(far, 44.0, received),
        )
    shown = [(at - before, reference) for at, reference, _ in viewer.shown]
    steps = [(b - a) / 1e3 for (_, a), (_, b) in pairwise(shown)]
    figures["cut_reconnects"] = viewer.statistics.reconnects
    figures["cut_stalls"] = viewer.statistics.gaps
    figures["cut_dark_ms"] = round(viewer.statistics.dark_ms)
    figures["cut_shown_twice"] = sum(step < 0 for step in steps)
    figures["cut_longest_step_ms"] = round(max(steps))
    figures["cut_kb_after"] = round((received[1] - received[0]) / 1e3, 1)
    return figures


async def _sample_received_bytes(far: FarEnd, after: float, into: list[int]) -> None:
    await asyncio.sleep(after)
    into.append(far.received_bytes)


CASES = (*LINKS, "audio", "steps", "live", "clock", "proxied", "join", "cut", "traces")


async def run_cases(network: EmulatedNetwork, only: set[str], seconds: float) -> Figures:
    """Run the selected cases one after the other against a running server."""
    url = f"http://127.0.0.1:{SERVER_PORT}"
    async with Client(url) as client:
        motion = (await client.motions())[0]["id"]
    motion_decoder.warm_up()
    bench = BenchContext(network, url, motion, await measure_clock_offset())
    figures: Figures = {}

    async def case(names: set[str], measure: Callable[[], Awaitable[Figures]]) -> None:
        if only & names:
            found = await measure()
            for name, value in found.items():
                print(f"{name:<40}{value!s:>10}", flush=True)
            figures.update(found)

    await case(set(LINKS), lambda: measure_first_pose(bench, only))
    await case({"live", "clock"}, lambda: measure_live(bench))
    await case({"proxied"}, lambda: measure_proxied(bench))
    await case({"audio"}, lambda: measure_audio(bench))
    await case({"steps"}, lambda: measure_rate_steps(bench))
    await case({"join"}, lambda: measure_join(bench))
    await case({"cut"}, lambda: measure_outage(bench))
    await case({"traces"}, lambda: measure_traces(bench, seconds, "28k8", "56k"))
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default=",".join(CASES), help=f"comma-separated cases of {', '.join(CASES)}")
    parser.add_argument("--seconds", type=float, default=60.0, help="seconds per trace")
    parser.add_argument("--data", type=Path, help="data folder of the server; default: a temporary folder")
    options = parser.parse_args()
    if (reason := missing_requirement()) is not None:
        print(f"skipped: {reason}")
        print(json.dumps({"skipped": reason}))
        return
    only = set(options.only.split(","))
    if unknown := only - set(CASES):
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder, open_network() as network:
        server = network.run(
            [sys.executable, "-m", "bunraku.cli", "up", "--demo", "--host", "0.0.0.0", "--port", str(SERVER_PORT),
             "--data", str(options.data or folder)],
            stdout=subprocess.PIPE,
            env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "BUNRAKU_PUBLISHED": "127.0.0.1"},
        )  # fmt: skip
        assert server.stdout is not None
        try:
            next(line for line in server.stdout if re.search(r"is at http://", line))
            figures = asyncio.run(run_cases(network, only, options.seconds))
        finally:
            server.terminate()
            server.wait(20)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
