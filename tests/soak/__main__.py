"""Soak test: `make soak MINUTES=60`. The last line printed is one JSON object.

Two replicas of every service run on a real NATS server and a real PostgreSQL server. Viewers come and go, a hand is
controlled, motions are uploaded and recorded, sessions open and end, and replicas are killed in turn. A row per minute
shows overlay gaps, memory and descriptors. The exit status is 1 if a criterion is not met.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bunraku.http.access_control import Role
from tests.bench.fanout_processes import LineProcess
from tests.credentials import make_token
from tests.soak.replicas import REPLICAS, Replicas, run_replicas
from tests.soak.samples import SampleLog
from tests.soak.workload import TOKEN_LIFETIME_S, Workload

SAMPLE_INTERVAL_S = 10.0
DOWNTIME_S = 3.0
"""Time for which a killed replica is down."""
MAX_DRAIN_S = 15.0
"""Time after the end of all work until descriptors are counted."""
CHECKED_EACH_MINUTE = 10
"""Newest motions that are checked each minute; at the end all are."""
MAX_GAP_P99_MS = 60.0
MAX_SLOPE_MB = 1.0
MAX_DESCRIPTORS_LEFT = 16


class Soak:
    """One run: its figures and its violations."""

    def __init__(self, options: argparse.Namespace, replicas: Replicas) -> None:
        self.options, self.replicas = options, replicas
        self.samples = SampleLog()
        self.kills: list[str] = []
        self.workload = Workload({name: replicas.urls(name) for name in ("ingest", "session", "stream")})

    async def run(self) -> dict[str, Any]:
        """Run the test and return its figures."""
        idle = {name: descriptors for name, (_, _, descriptors) in self.replicas.measure().items()}
        await self.workload.start()
        path = f"/v1/sessions/{self.workload.session}/stream"
        streams = [url.replace("http", "ws") + path for url in self.replicas.urls("stream")]
        token = make_token(Role.VIEW, "soak audience", TOKEN_LIFETIME_S)
        settings = {"urls": streams, "token": token, "viewers": self.options.viewers, "churn": self.options.churn}
        with LineProcess([sys.executable, "-m", "tests.soak.audience"]) as audience:
            audience.write_line(json.dumps(settings))
            background = [asyncio.create_task(self._sample()), asyncio.create_task(self._kill_in_turn())]
            try:
                figures = await self._report_minutes(audience)
            finally:
                for task in background:
                    task.cancel()
                results = await asyncio.gather(*background, return_exceptions=True)
                await self.workload.stop()
        for result in results:
            if isinstance(result, BaseException) and not isinstance(result, asyncio.CancelledError):
                raise result
        await asyncio.to_thread(self._restart_stopped)
        await asyncio.sleep(min(MAX_DRAIN_S, self.options.minutes * 20))
        left = {
            name: descriptors - idle[name]
            for name, (_, _, descriptors) in self.replicas.measure().items()
            if name in REPLICAS
        }
        lost = await self.workload.find_lost_motions()
        await self.workload.close()
        return self._judge(figures, left, lost)

    async def _report_minutes(self, audience: LineProcess) -> dict[str, Any]:
        """Print a row per minute until the end; return the last figures of the viewers."""
        figures: dict[str, Any] = {}
        began = time.monotonic()
        minutes = 0
        while (left := began + self.options.minutes * 60 - time.monotonic()) > 0:
            await asyncio.sleep(min(left, 60.0))
            if left <= 60.0:
                await self._wait_for_minimum()
            minutes += 1
            figures = await asyncio.to_thread(audience.request, "figures")
            lost = await self.workload.find_lost_motions(CHECKED_EACH_MINUTE)
            measured = self.replicas.measure()
            print(format_minute(minutes, figures, measured, self.workload, len(lost), self.kills), flush=True)
        return figures

    async def _wait_for_minimum(self) -> None:
        """Wait until the least number of motions is acknowledged and a replica was killed, on a slow machine."""
        while not self.kills or len(self.workload.acknowledged) < self.options.min_acknowledged:  # noqa: ASYNC110
            await asyncio.sleep(0.1)

    async def _sample(self) -> None:
        while True:
            self.samples.add(time.monotonic(), self.replicas.measure())
            await asyncio.sleep(SAMPLE_INTERVAL_S)

    async def _kill_in_turn(self) -> None:
        """Kill one replica after the other with SIGKILL, and start each again."""
        interval_s = min(self.options.kill_minutes * 60, self.options.minutes * 60 / 2)
        while True:
            for name in REPLICAS:
                await asyncio.sleep(interval_s)
                await asyncio.to_thread(self.replicas.processes[name].kill)
                self.kills.append(name)
                await asyncio.sleep(DOWNTIME_S)
                await asyncio.to_thread(self.replicas.processes[name].start)

    def _restart_stopped(self) -> None:
        for process in self.replicas.processes.values():
            if not process.is_running:
                process.start()

    def _judge(self, figures: dict[str, Any], left: dict[str, int], lost: list[str]) -> dict[str, Any]:
        slopes = self.samples.worst_slopes()
        services = {name: slope for name, slope in slopes.items() if name in REPLICAS}
        gap = figures["gap_p99_ms_total"]
        criteria = {
            "gap": gap <= self.options.max_gap_ms and figures["overlays"] > 0,
            "rss": all(slope < MAX_SLOPE_MB for slope in services.values()),
            "descriptors": all(number <= MAX_DESCRIPTORS_LEFT for number in left.values()),
            "lost": not lost,
        }
        return {
            "minutes": self.options.minutes,
            "viewers": self.options.viewers,
            "kills": len(self.kills),
            "acknowledged": len(self.workload.acknowledged),
            "lost": len(lost),
            "gap_p99_ms": gap,
            # empty for a run that is too short for a trend
            "rss_mb_per_10_min": slopes,
            "descriptors_left": left,
            **{f"held_{name}": held for name, held in criteria.items()},
            "held": all(criteria.values()),
        }


def format_minute(
    minute: int,
    figures: dict[str, Any],
    measured: dict[str, tuple[int, float, int]],
    workload: Workload,
    lost: int,
    kills: list[str],
) -> str:
    """Format the row of one minute."""
    processes = ", ".join(f"{name} {rss:.0f} MB {descriptors} fds" for name, (_, rss, descriptors) in measured.items())
    work = ", ".join(f"{name} {number}" for name, number in sorted(workload.counts.items()))
    return (
        f"{minute:>3} min  {figures['connected']} viewers, {figures['joins']} joins, {figures['dropped']} dropped, "
        f"{figures['failed']} failed  gap p50 {figures['gap_p50_ms']:.0f} p99 {figures['gap_p99_ms']:.0f} "
        f"max {figures['gap_max_ms']:.0f} ms  lost {lost} of {len(workload.acknowledged)}  kills {len(kills)}  "
        f"{processes}  ({work})"
    )


def main() -> None:
    """Parse the command line, run the test and print its figures."""
    parser = argparse.ArgumentParser(prog="make soak", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--minutes", type=float, default=60.0, help="duration")
    parser.add_argument("--viewers", type=int, default=500)
    parser.add_argument("--churn", type=float, default=10.0, help="viewers that leave, and that join, per second")
    parser.add_argument("--kill-minutes", type=float, default=5.0, help="interval between kills")
    parser.add_argument(
        "--min-acknowledged", type=int, default=0, help="the run lasts longer until so many motions are acknowledged"
    )
    parser.add_argument("--max-gap-ms", type=float, default=MAX_GAP_P99_MS, help="limit of the overlay gap p99")
    options = parser.parse_args()
    # end the replicas as well if this process is terminated
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with tempfile.TemporaryDirectory(prefix="bunraku-soak-") as folder, run_replicas(Path(folder)) as replicas:
        figures = asyncio.run(Soak(options, replicas).run())
    print(json.dumps(figures))
    sys.exit(not figures["held"])


if __name__ == "__main__":
    main()
