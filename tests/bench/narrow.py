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
from bunraku.codec import decode
from bunraku.motion.skeleton import points
from bunraku.playout.blocks import Pose
from tests.bench.naive import naive_relay
from tests.bench.narrow_traces import traces
from tests.bench.narrow_viewing import (
    LINES,
    PORT,
    Bench,
    Figures,
    Patient,
    Screen,
    percentile,
    truth_of_the_clock,
    whole,
)
from tests.bench.network import Far, Link, Network, missing, network
from tests.proxies import proxy


async def first_poses(bench: Bench, only: set[str]) -> Figures:
    """Cases 9k6, 28k8 and 56k."""
    cases = [name for name in LINES if name in only]
    figures: Figures = {}
    with bench.net.lines([LINES[name] for name in cases for _ in range(5)]) as fars:
        screens = [bench.dance(far, "?tracks=motion") for far in fars]
        # the first of each stays; one after the other, as they share two cores
        watching = []
        for nth in range(5):
            for case in range(len(cases)):
                screen = screens[5 * case + nth]
                watching.append(asyncio.create_task(screen.look(60.0 if nth == 0 else 4.0)))
                await asyncio.sleep(0.7)
        await asyncio.gather(*watching)
        for case, name in enumerate(cases):
            mine = screens[5 * case : 5 * case + 5]
            first = [screen.figures.first_pose_ms or float("inf") for screen in mine]
            figures[f"first_pose_ms_{name}"] = whole(float(np.median(first)))
            figures[f"first_pose_worst_ms_{name}"] = whole(max(first))
            figures[f"stalls_{name}"] = sum(screen.figures.gaps for screen in mine)
            figures[f"shown_kbps_{name}"] = round(mine[0].figures.shown_kbps, 2)
            figures[f"line_kbps_{name}"] = round(fars[5 * case].received * 8e-3 / 60.0, 2)
    return figures


async def audio(bench: Bench) -> Figures:
    """Case audio."""
    figures: Figures = {}
    with bench.net.lines(list(LINES.values())) as fars:
        screens = [bench.dance(far) for far in fars]
        watching = []
        for screen in screens:
            watching.append(asyncio.create_task(screen.look(60.0)))
            await asyncio.sleep(0.7)
        await asyncio.gather(*watching)
        for name, screen, far in zip(LINES, screens, fars, strict=True):
            late = [
                heard for (at, _, _), heard in zip(screen.shown, screen.heard, strict=True) if at > screen.begun + 30e6
            ]
            figures[f"audio_first_pose_ms_{name}"] = whole(screen.figures.first_pose_ms or float("inf"))
            figures[f"audio_stalls_{name}"] = screen.figures.gaps
            figures[f"audio_share_{name}"] = round(float(np.mean(late)), 3)
            figures[f"audio_rate_{name}"] = screen.figures.audio_rate
            figures[f"audio_shown_kbps_{name}"] = round(screen.figures.shown_kbps, 2)
            figures[f"audio_line_kbps_{name}"] = round(far.received * 8e-3 / 60.0, 2)
    return figures


async def proxied(bench: Bench) -> Figures:
    """Case proxied: the proxy is at the near end."""
    figures: Figures = {}
    seconds, settle = 40.0, 5.0

    async def work(session: str) -> None:
        async with proxy(PORT, host="0.0.0.0", at=PORT + 2):
            with bench.net.lines([Link(28_800, 75, queue_bytes=64_000)]) as (far,):
                screen = Screen(
                    f"ws://{far.host}:{PORT + 2}/v1/sessions/{session}/stream?tracks=motion", far, bench.truth
                )
                await screen.look(seconds)
                late = [ms for at, ms, _ in screen.came if at - screen.begun > settle * 1e6]
                figures["proxied_p50_ms_28k8"] = round(percentile(late, 50))
                figures["proxied_p95_ms_28k8"] = round(percentile(late, 95))
                figures["proxied_fps_28k8"] = round(len(late) / (seconds - settle), 1)
                figures["proxied_stalls_28k8"] = screen.figures.gaps
                figures["proxied_line_used_28k8"] = round(far.received * 8 / 28_800 / seconds, 3)

    await bench.pulled(work, 5.0)
    return figures


async def steps(bench: Bench) -> Figures:
    """Case steps."""
    figures: Figures = {}

    async def work(session: str) -> None:
        with bench.net.lines([Link(56_000, 75, step="10:14400,18:56000")]) as (far,):
            begun = time.monotonic_ns() // 1000
            screen = bench.screen(far, f"/v1/sessions/{session}/stream?tracks=motion")
            await screen.look(26.0)

        def late(begin: float, end: float) -> list[float]:
            return [ms for at, ms, _ in screen.came if begin * 1e6 <= at - begun < end * 1e6]

        def rate(begin: float, end: float) -> float:
            return sum(frames for at, _, frames in screen.came if begin * 1e6 <= at - begun < end * 1e6) / (end - begin)

        figures["steps_stalls"] = screen.figures.gaps
        figures["steps_peak_ms"] = round(max(late(4, 26)))
        figures["steps_after_1500_ms"] = round(percentile(late(11.5, 18), 95))
        figures["steps_fps_56k"] = round(rate(4, 10), 1)
        figures["steps_fps_14k4"] = round(rate(11.5, 18), 1)
        figures["steps_fps_back"] = round(rate(20, 26), 1)

    await bench.pulled(work)
    return figures


async def live(bench: Bench) -> Figures:
    """Cases live and clock: one line ours, one naive, one whose viewer's clock is off."""
    figures: Figures = {}
    seconds, settle = 60.0, 5.0

    async def work(session: str) -> None:
        path = f"/v1/sessions/{session}/stream?tracks=motion"
        link = Link(28_800, 75, queue_bytes=64_000)
        async with naive_relay(f"ws://127.0.0.1:{PORT}{path}", PORT + 1):
            with bench.net.lines([link] * 3) as fars:
                ours, naive = (
                    bench.screen(fars[0], path),
                    Patient(f"ws://{fars[1].host}:{PORT + 1}/", fars[1], bench.truth),
                )
                off = bench.screen(fars[2], path, now=lambda: round(time.monotonic_ns() * 1.0002e-3) + 3_600_000_000)
                carried = 0

                async def count() -> None:
                    nonlocal carried
                    await asyncio.sleep(settle)
                    before = fars[0].received
                    await asyncio.sleep(seconds - settle - 1.0)
                    carried = fars[0].received - before

                await asyncio.gather(ours.look(seconds), naive.look(seconds), off.look(seconds), count())
        begun = ours.came[0][0] + settle * 1e6
        mine = [(ms, frames) for at, ms, frames in ours.came if at > begun]
        lateness = [ms for ms, _ in mine]
        written = [ms for at, ms, _ in naive.came if at > begun]
        span = (ours.came[-1][0] - begun) / 1e6
        figures["live_p50_ms_28k8"] = round(percentile(lateness, 50))
        figures["live_p95_ms_28k8"] = round(percentile(lateness, 95))
        figures["live_fps_28k8"] = round(sum(frames for _, frames in mine) / span, 1)
        figures["live_messages_28k8"] = round(len(mine) / span, 1)
        figures["live_line_used_28k8"] = round(carried * 8 / (seconds - settle - 1.0) / link.rate, 3)
        figures["live_stalls_28k8"] = ours.figures.gaps
        figures["live_shown_kbps_28k8"] = round(ours.figures.shown_kbps, 2)
        figures["naive_p95_ms_28k8"] = round(percentile(written, 95))
        figures["times_naive"] = round(percentile(written, 95) / percentile(lateness, 95), 1)
        for name, screen in (("clock", ours), ("clock_off", off)):
            # the first second may go by the greeting's guess
            errors = np.abs(screen.clock_errors[60:])
            figures[f"{name}_median_ms"] = round(percentile(errors, 50), 2)
            figures[f"{name}_p95_ms"] = round(percentile(errors, 95), 2)

    # briskly, so that a stage sends all its frames: of slower hands it sends every second one
    await bench.pulled(work, 5.0)
    return figures


async def join(bench: Bench) -> Figures:
    """Case join."""
    figures: Figures = {}

    async def work(session: str) -> None:
        path = f"/v1/sessions/{session}/stream?tracks=motion"
        with bench.net.lines([Link(64_000, 50)]) as (far,):
            quick = Screen(f"ws://127.0.0.1:{PORT}{path}", None, bench.truth)
            seeing = asyncio.create_task(quick.look(8.0))
            await asyncio.sleep(4.0)
            late = bench.screen(far, path)
            apart: list[float] = []

            def picture(at: int, pose: Pose) -> None:
                other = quick.pose_at(at)
                if other is not None and late.track is not None:
                    ours, theirs = (points(late.track.figure, *one) for one in (pose, other))
                    apart.append(float(np.linalg.norm(ours - theirs, axis=-1).max()) * 1e3)

            await late.watch(4.0, picture)
            await seeing
            now = time.monotonic_ns() // 1000
            figures["join_first_pose_ms_64k"] = whole(late.figures.first_pose_ms or float("inf"))
            figures["join_apart_mm_p95"] = round(percentile(apart[60:], 95), 1)
            figures["join_clock_apart_ms"] = round(abs(late.clock.at(now) - quick.clock.at(now)) / 1e3, 2)

    await bench.pulled(work)
    return figures


async def cut(bench: Bench) -> Figures:
    """Case cut."""
    figures: Figures = {}
    begin, end = 8.0, 33.0
    with bench.net.lines([Link(28_800, 75, cut=(begin, end))]) as (far,):
        screen = bench.dance(far, "?tracks=motion")
        before = time.monotonic_ns() // 1000
        received: list[int] = []
        await asyncio.gather(screen.look(45.0), _counted(far, end - 1.0, received), _counted(far, 44.0, received))
    shown = [(at - before, reference) for at, reference, _ in screen.shown]
    steps = [(b - a) / 1e3 for (_, a), (_, b) in pairwise(shown)]
    figures["cut_reconnects"] = screen.figures.reconnects
    figures["cut_stalls"] = screen.figures.gaps
    figures["cut_dark_ms"] = round(screen.figures.dark_ms)
    figures["cut_shown_twice"] = sum(step < 0 for step in steps)
    figures["cut_longest_step_ms"] = round(max(steps))
    figures["cut_kb_after"] = round((received[1] - received[0]) / 1e3, 1)
    return figures


async def _counted(far: Far, after: float, into: list[int]) -> None:
    await asyncio.sleep(after)
    into.append(far.received)


CASES = (*LINES, "audio", "steps", "live", "clock", "proxied", "join", "cut", "traces")


async def run(net: Network, only: set[str], seconds: float) -> Figures:
    """The cases that were asked for, one after the other, against a server that is up."""
    url = f"http://127.0.0.1:{PORT}"
    async with Client(url) as client:
        motion = (await client.motions())[0]["id"]
    decode.warm()
    bench = Bench(net, url, motion, await truth_of_the_clock())
    figures: Figures = {}

    async def case(names: set[str], made: Callable[[], Awaitable[Figures]]) -> None:
        if only & names:
            found = await made()
            for name, value in found.items():
                print(f"{name:<40}{value!s:>10}", flush=True)
            figures.update(found)

    await case(set(LINES), lambda: first_poses(bench, only))
    await case({"live", "clock"}, lambda: live(bench))
    await case({"proxied"}, lambda: proxied(bench))
    await case({"audio"}, lambda: audio(bench))
    await case({"steps"}, lambda: steps(bench))
    await case({"join"}, lambda: join(bench))
    await case({"cut"}, lambda: cut(bench))
    await case({"traces"}, lambda: traces(bench, seconds, "28k8", "56k"))
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default=",".join(CASES), help=f"of {', '.join(CASES)}")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each trace")
    parser.add_argument("--data", type=Path, help="folder of the server's things; default a new one")
    given = parser.parse_args()
    if (reason := missing()) is not None:
        print(f"skipped: {reason}")
        print(json.dumps({"skipped": reason}))
        return
    only = set(given.only.split(","))
    if unknown := only - set(CASES):
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder, network() as net:
        server = net.run(
            [sys.executable, "-m", "bunraku.cli", "up", "--demo", "--host", "0.0.0.0", "--port", str(PORT), "--data",
             str(given.data or folder)],
            stdout=subprocess.PIPE,
            env={**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "BUNRAKU_PUBLISHED": "127.0.0.1"},
        )  # fmt: skip
        assert server.stdout is not None
        try:
            next(line for line in server.stdout if re.search(r"is at http://", line))
            figures = asyncio.run(run(net, only, given.seconds))
        finally:
            server.terminate()
            server.wait(20)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
