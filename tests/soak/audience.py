"""Many viewers that come and go, in a separate process: `python -m tests.soak.audience`.

The first line of standard input is a JSON object: `urls` of the streams, `token`, `viewers` and `churn`, the viewers
that leave per second. Each leaving viewer is replaced by a new one. Each further line is answered with the figures
since the previous one: overlay gaps in ms of all viewers, joins, disconnections by the server, failed joins, connected
viewers. A viewer that the server disconnects reconnects at the next URL; the time without overlays counts as a gap.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import random
import sys
import time
from typing import Any

import numpy as np
import uvloop

from bunraku.client.authorization import authorization
from bunraku.client.load_generator import RESERVED_FILE_DESCRIPTORS, _raise_file_limit
from bunraku.client.message_socket import MessageSocket
from bunraku.wire.messages import Ping, Report
from bunraku.wire.overlay import Overlay

JOIN_INTERVAL_S = 0.025
"""Interval between the first connections of viewers."""
REPORT_INTERVAL_S = 1.0
OPEN_TIMEOUT_S = 10.0
RECONNECT_INTERVAL_S = 0.5
HISTOGRAM_MS = 20_000
"""Gaps are counted in bins of 1 ms; longer ones count in the last bin."""


class GapHistogram:
    """Number of gaps by their length in ms."""

    def __init__(self) -> None:
        self.counts = np.zeros(HISTOGRAM_MS, np.int64)

    def add(self, seconds: float) -> None:
        """Count a gap."""
        self.counts[min(int(seconds * 1e3), HISTOGRAM_MS - 1)] += 1

    def percentile(self, share: float) -> float:
        """Return the gap in ms that a share of all gaps does not exceed."""
        total = np.cumsum(self.counts)
        return float(np.searchsorted(total, share * total[-1])) if total[-1] else 0.0


class SoakViewer(MessageSocket):
    """Viewer that records the gaps between overlays of a controlled limb."""

    __slots__ = ("_histogram", "last_overlay_at")

    def __init__(self, url: str, token: str, histogram: GapHistogram, last_overlay_at: float | None) -> None:
        super().__init__(url, authorization(token))
        self._histogram = histogram
        self.last_overlay_at = last_overlay_at

    def on_message(self, message: bytes) -> None:
        if message[0] == Overlay.TYPE and message[1] & 15:
            now = time.monotonic()
            if self.last_overlay_at is not None:
                self._histogram.add(now - self.last_overlay_at)
            self.last_overlay_at = now


class Audience:
    """Viewers of one session on several replicas."""

    def __init__(self, urls: list[str], token: str, viewers: int, churn: float) -> None:
        self.minute, self.total = GapHistogram(), GapHistogram()
        self.connected = self.joins = self.dropped = self.failed = 0
        self._urls = itertools.cycle(urls)
        self._token = token
        self._count = viewers
        self._mean_stay_s = viewers / churn if churn > 0 else float("inf")
        self._tasks: list[asyncio.Task[None]] = []

    async def start(self) -> None:
        """Connect the viewers one after the other."""
        for _ in range(self._count):
            self._tasks.append(asyncio.create_task(self._occupy_seat()))
            await asyncio.sleep(JOIN_INTERVAL_S)

    async def stop(self) -> None:
        """Disconnect all viewers."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def take_figures(self) -> dict[str, Any]:
        """Return the figures since the last call, and those of the whole run."""
        self.total.counts += self.minute.counts
        used = np.flatnonzero(self.minute.counts)
        figures = {
            "gap_p50_ms": self.minute.percentile(0.5),
            "gap_p99_ms": self.minute.percentile(0.99),
            "gap_max_ms": float(used[-1]) if used.size else 0.0,
            "gap_p99_ms_total": self.total.percentile(0.99),
            "overlays": int(self.minute.counts.sum()),
            "connected": self.connected,
            "joins": self.joins,
            "dropped": self.dropped,
            "failed": self.failed,
        }
        self.minute.counts[:] = 0
        self.joins = self.dropped = self.failed = 0
        return figures

    async def _occupy_seat(self) -> None:
        """Keep one viewer connected; after a random stay it leaves and a new one joins."""
        last_overlay_at: float | None = None
        while True:
            stay_s = random.expovariate(1 / self._mean_stay_s) if np.isfinite(self._mean_stay_s) else float("inf")
            viewer = SoakViewer(next(self._urls), self._token, self.minute, last_overlay_at)
            try:
                async with asyncio.timeout(OPEN_TIMEOUT_S):
                    await viewer.open()
            except (OSError, TimeoutError):
                self.failed += 1
                await asyncio.sleep(RECONNECT_INTERVAL_S)
                continue
            self.joins += 1
            self.connected += 1
            try:
                await self._watch(viewer, stay_s)
            finally:
                self.connected -= 1
                was_dropped = viewer.closed
                viewer.close()
            self.dropped += was_dropped
            last_overlay_at = viewer.last_overlay_at if was_dropped else None
            if was_dropped:
                await asyncio.sleep(RECONNECT_INTERVAL_S * random.random())

    async def _watch(self, viewer: SoakViewer, stay_s: float) -> None:
        until, sequence = time.monotonic() + stay_s, 0
        while not viewer.closed and (left := until - time.monotonic()) > 0:
            viewer.send(Ping(sequence, time.monotonic_ns() // 1000).pack(), Report(6_000_000).pack())
            sequence += 1
            await asyncio.sleep(min(REPORT_INTERVAL_S, left))


async def run(urls: list[str], token: str, viewers: int, churn: float) -> None:
    """Watch until standard input ends."""
    _raise_file_limit(viewers * 2 + RESERVED_FILE_DESCRIPTORS)
    audience = Audience(urls, token, viewers, churn)
    starting = asyncio.create_task(audience.start())
    try:
        while (await asyncio.to_thread(sys.stdin.readline)).strip():
            print(json.dumps(audience.take_figures()), flush=True)
    finally:
        starting.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await starting
        await audience.stop()


if __name__ == "__main__":
    uvloop.run(run(**json.loads(sys.stdin.readline())))
