"""How Bunraku does on narrow lines: `make bench-narrow`. The last line printed is one JSON object.

The real server in a process of its own at the near end of emulated lines (`network.py`), headless viewers at their far
ends, real kernel TCP between. Needs root; `--only 28k8,live` runs some cases alone, `make bench-narrow
ARGUMENTS="--only live"`.

    9k6 28k8 56k   a motion at these kbit/s (round trips of 300, 150, 150 ms): time from the start of the TCP connection
                   to the first pose (median of five lines side by side), and gaps over 60 s on one of them
    audio          the same lines with all that the dance has: its music, camera and lights; also for which share of the
                   last 30 s there was sound, and at which rate it came last
    steps          56 -> 14.4 -> 56 kbit/s under a pulled dancer: gaps, latency of the live overlay
    live           all four limbs pulled, on 28.8 kbit/s: latency, how much of the line is used, and the same written
                   naively: each overlay as it comes
    proxied        the same dancer on the same line, with a proxy between server and line: latency, and use of the line
    clock          the same line, a viewer's clock right, and an hour off and 200 ppm fast
    join           a session that runs already, 64 kbit/s: the right pose, and the difference to one on a quick line
    cut            28.8 kbit/s, cut for 25 s: what is shown after
    traces         18 lines of 3G at a mean of 28.8 and of 56 kbit/s: stalls against those of the lowest rate alone, and
                   the mean rate shown against the best constant one that an oracle sends

But for `audio` all viewers ask for the motion alone. Latency of an overlay is from when the session made its newest
frame to when it came. Both ends share one kernel's clock, so a viewer's true offset is known.
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
    """Cases 9k6, 28k8 and 56k."""
    cases = [name for name in LINKS if name in only]
    figures: Figures = {}
    with bench.network.open_links([LINKS[name] for name in cases for _ in range(5)]) as fars:
        screens = [bench.create_motion_viewer(far, "?tracks=motion") for far in fars]
        # the first of each stays; one after the other, as they share two cores
        watching = []
        for nth in range(5):
            for case in range(len(cases)):
                screen = screens[5 * case + nth]
                watching.append(asyncio.create_task(screen.watch_and_measure(60.0 if nth == 0 else 4.0)))
                await asyncio.sleep(0.7)
        await asyncio.gather(*watching)
        for case, name in enumerate(cases):
            mine = screens[5 * case : 5 * case + 5]
            first = [screen.statistics.first_pose_ms or float("inf") for screen in mine]
            figures[f"first_pose_ms_{name}"] = round_finite(float(np.median(first)))
            figures[f"first_pose_worst_ms_{name}"] = round_finite(max(first))
            figures[f"stalls_{name}"] = sum(screen.statistics.gaps for screen in mine)
            figures[f"shown_kbps_{name}"] = round(mine[0].statistics.shown_kbps, 2)
            figures[f"line_kbps_{name}"] = round(fars[5 * case].received_bytes * 8e-3 / 60.0, 2)
    return figures


async def measure_audio(bench: BenchContext) -> Figures:
    """Case audio."""
    figures: Figures = {}
    with bench.network.open_links(list(LINKS.values())) as fars:
        screens = [bench.create_motion_viewer(far) for far in fars]
        watching = []
        for screen in screens:
            watching.append(asyncio.create_task(screen.watch_and_measure(60.0)))
            await asyncio.sleep(0.7)
        await asyncio.gather(*watching)
        for name, screen, far in zip(LINKS, screens, fars, strict=True):
            late = [
                heard
                for (at, _, _), heard in zip(screen.shown, screen.audio_available, strict=True)
                if at > screen.started_us + 30e6
            ]
            figures[f"audio_first_pose_ms_{name}"] = round_finite(screen.statistics.first_pose_ms or float("inf"))
            figures[f"audio_stalls_{name}"] = screen.statistics.gaps
            figures[f"audio_share_{name}"] = round(float(np.mean(late)), 3)
            figures[f"audio_rate_{name}"] = screen.statistics.audio_rate
            figures[f"audio_shown_kbps_{name}"] = round(screen.statistics.shown_kbps, 2)
            figures[f"audio_line_kbps_{name}"] = round(far.received_bytes * 8e-3 / 60.0, 2)
    return figures


async def measure_proxied(bench: BenchContext) -> Figures:
    """Case proxied: the proxy is at the near end."""
    figures: Figures = {}
    seconds, settle = 40.0, 5.0

    async def work(session: str) -> None:
        async with run_reverse_proxy(SERVER_PORT, host="0.0.0.0", listen_port=SERVER_PORT + 2):
            with bench.network.open_links([EmulatedLink(28_800, 75, queue_bytes=64_000)]) as (far,):
                screen = MeasuringViewer(
                    f"ws://{far.host}:{SERVER_PORT + 2}/v1/sessions/{session}/stream?tracks=motion",
                    far,
                    bench.true_clock_offset_us,
                )
                await screen.watch_and_measure(seconds)
                late = [ms for at, ms, _ in screen.overlay_arrivals if at - screen.started_us > settle * 1e6]
                figures["proxied_p50_ms_28k8"] = round(percentile(late, 50))
                figures["proxied_p95_ms_28k8"] = round(percentile(late, 95))
                figures["proxied_fps_28k8"] = round(len(late) / (seconds - settle), 1)
                figures["proxied_stalls_28k8"] = screen.statistics.gaps
                figures["proxied_line_used_28k8"] = round(far.received_bytes * 8 / 28_800 / seconds, 3)

    await bench.run_controlled(work, 5.0)
    return figures


async def measure_rate_steps(bench: BenchContext) -> Figures:
    """Case steps."""
    figures: Figures = {}

    async def work(session: str) -> None:
        with bench.network.open_links([EmulatedLink(56_000, 75, bitrate_steps="10:14400,18:56000")]) as (far,):
            begun = time.monotonic_ns() // 1000
            screen = bench.create_viewer(far, f"/v1/sessions/{session}/stream?tracks=motion")
            await screen.watch_and_measure(26.0)

        def late(begin: float, end: float) -> list[float]:
            return [ms for at, ms, _ in screen.overlay_arrivals if begin * 1e6 <= at - begun < end * 1e6]

        def rate(begin: float, end: float) -> float:
            return sum(frames for at, _, frames in screen.overlay_arrivals if begin * 1e6 <= at - begun < end * 1e6) / (
                end - begin
            )

        figures["steps_stalls"] = screen.statistics.gaps
        figures["steps_peak_ms"] = round(max(late(4, 26)))
        figures["steps_after_1500_ms"] = round(percentile(late(11.5, 18), 95))
        figures["steps_fps_56k"] = round(rate(4, 10), 1)
        figures["steps_fps_14k4"] = round(rate(11.5, 18), 1)
        figures["steps_fps_back"] = round(rate(20, 26), 1)

    await bench.run_controlled(work)
    return figures


async def measure_live(bench: BenchContext) -> Figures:
    """Cases live and clock: one line ours, one naive, one whose viewer's clock is off."""
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
                off = bench.create_viewer(
                    fars[2], path, now=lambda: round(time.monotonic_ns() * 1.0002e-3) + 3_600_000_000
                )
                carried = 0

                async def count() -> None:
                    nonlocal carried
                    await asyncio.sleep(settle)
                    before = fars[0].received_bytes
                    await asyncio.sleep(seconds - settle - 1.0)
                    carried = fars[0].received_bytes - before

                await asyncio.gather(
                    ours.watch_and_measure(seconds),
                    naive.watch_and_measure(seconds),
                    off.watch_and_measure(seconds),
                    count(),
                )
        begun = ours.overlay_arrivals[0][0] + settle * 1e6
        mine = [(ms, frames) for at, ms, frames in ours.overlay_arrivals if at > begun]
        lateness = [ms for ms, _ in mine]
        written = [ms for at, ms, _ in naive.overlay_arrivals if at > begun]
        span = (ours.overlay_arrivals[-1][0] - begun) / 1e6
        figures["live_p50_ms_28k8"] = round(percentile(lateness, 50))
        figures["live_p95_ms_28k8"] = round(percentile(lateness, 95))
        figures["live_fps_28k8"] = round(sum(frames for _, frames in mine) / span, 1)
        figures["live_messages_28k8"] = round(len(mine) / span, 1)
        figures["live_line_used_28k8"] = round(carried * 8 / (seconds - settle - 1.0) / link.bitrate, 3)
        figures["live_stalls_28k8"] = ours.statistics.gaps
        figures["live_shown_kbps_28k8"] = round(ours.statistics.shown_kbps, 2)
        figures["naive_p95_ms_28k8"] = round(percentile(written, 95))
        figures["times_naive"] = round(percentile(written, 95) / percentile(lateness, 95), 1)
        for name, screen in (("clock", ours), ("clock_off", off)):
            # the first second may go by the greeting's guess
            errors = np.abs(screen.clock_errors[60:])
            figures[f"{name}_median_ms"] = round(percentile(errors, 50), 2)
            figures[f"{name}_p95_ms"] = round(percentile(errors, 95), 2)

    # briskly, so that a stage sends all its frames: of slower hands it sends every second one
    await bench.run_controlled(work, 5.0)
    return figures


async def measure_join(bench: BenchContext) -> Figures:
    """Case join."""
    figures: Figures = {}

    async def work(session: str) -> None:
        path = f"/v1/sessions/{session}/stream?tracks=motion"
        with bench.network.open_links([EmulatedLink(64_000, 50)]) as (far,):
            quick = MeasuringViewer(f"ws://127.0.0.1:{SERVER_PORT}{path}", None, bench.true_clock_offset_us)
            seeing = asyncio.create_task(quick.watch_and_measure(8.0))
            await asyncio.sleep(4.0)
            late = bench.create_viewer(far, path)
            apart: list[float] = []

            def picture(at: int, pose: Pose) -> None:
                other = quick.pose_at(at)
                if other is not None and late.track is not None:
                    ours, theirs = (joint_and_tip_positions(late.track.figure, *one) for one in (pose, other))
                    apart.append(float(np.linalg.norm(ours - theirs, axis=-1).max()) * 1e3)

            await late.watch(4.0, picture)
            await seeing
            now = time.monotonic_ns() // 1000
            figures["join_first_pose_ms_64k"] = round_finite(late.statistics.first_pose_ms or float("inf"))
            figures["join_apart_mm_p95"] = round(percentile(apart[60:], 95), 1)
            figures["join_clock_apart_ms"] = round(abs(late.clock.at(now) - quick.clock.at(now)) / 1e3, 2)

    await bench.run_controlled(work)
    return figures


async def measure_outage(bench: BenchContext) -> Figures:
    """Case cut."""
    figures: Figures = {}
    begin, end = 8.0, 33.0
    with bench.network.open_links([EmulatedLink(28_800, 75, outage_s=(begin, end))]) as (far,):
        screen = bench.create_motion_viewer(far, "?tracks=motion")
        before = time.monotonic_ns() // 1000
        received: list[int] = []
        await asyncio.gather(
            screen.watch_and_measure(45.0),
            _sample_received_bytes(far, end - 1.0, received),
            _sample_received_bytes(far, 44.0, received),
        )
    shown = [(at - before, reference) for at, reference, _ in screen.shown]
    steps = [(b - a) / 1e3 for (_, a), (_, b) in pairwise(shown)]
    figures["cut_reconnects"] = screen.statistics.reconnects
    figures["cut_stalls"] = screen.statistics.gaps
    figures["cut_dark_ms"] = round(screen.statistics.dark_ms)
    figures["cut_shown_twice"] = sum(step < 0 for step in steps)
    figures["cut_longest_step_ms"] = round(max(steps))
    figures["cut_kb_after"] = round((received[1] - received[0]) / 1e3, 1)
    return figures


async def _sample_received_bytes(far: FarEnd, after: float, into: list[int]) -> None:
    await asyncio.sleep(after)
    into.append(far.received_bytes)


CASES = (*LINKS, "audio", "steps", "live", "clock", "proxied", "join", "cut", "traces")


async def run_cases(net: EmulatedNetwork, only: set[str], seconds: float) -> Figures:
    """The cases that were asked for, one after the other, against a server that is up."""
    url = f"http://127.0.0.1:{SERVER_PORT}"
    async with Client(url) as client:
        motion = (await client.motions())[0]["id"]
    motion_decoder.warm_up()
    bench = BenchContext(net, url, motion, await measure_clock_offset())
    figures: Figures = {}

    async def case(names: set[str], made: Callable[[], Awaitable[Figures]]) -> None:
        if only & names:
            found = await made()
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
    parser.add_argument("--only", default=",".join(CASES), help=f"of {', '.join(CASES)}")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each trace")
    parser.add_argument("--data", type=Path, help="folder of the server's things; default a new one")
    given = parser.parse_args()
    if (reason := missing_requirement()) is not None:
        print(f"skipped: {reason}")
        print(json.dumps({"skipped": reason}))
        return
    only = set(given.only.split(","))
    if unknown := only - set(CASES):
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder, open_network() as net:
        server = net.run(
            [sys.executable, "-m", "bunraku.cli", "up", "--demo", "--host", "0.0.0.0", "--port", str(SERVER_PORT), "--data",
             str(given.data or folder)],
            stdout=subprocess.PIPE,
            env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "BUNRAKU_PUBLISHED": "127.0.0.1"},
        )  # fmt: skip
        assert server.stdout is not None
        try:
            next(line for line in server.stdout if re.search(r"is at http://", line))
            figures = asyncio.run(run_cases(net, only, given.seconds))
        finally:
            server.terminate()
            server.wait(20)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
