"""Load generator: many viewers of one stream in one process, to measure a server under load.

Each viewer has its own connection, receives messages and sends what a viewer sends once per second (a ping, and a
report of its buffer); nothing is decoded or drawn, so that thousands fit. All share one clock. Lateness refers to
arrival: an overlay is late if it arrives after its due time, a block if it arrives after its first frame is due;
messages in time have negative lateness.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from array import array
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bunraku.client.authorization import authorization
from bunraku.client.load_viewer import LoadState, LoadViewer

SEND_SLOTS = 50
"""Slots per second over which the viewers' reports are spread."""
RESERVED_FILE_DESCRIPTORS = 64
"""File descriptors of the process besides the viewers'."""


class FileLimitExceeded(ValueError):
    """Open-file limit of this process is too low for the requested number of connections."""


@dataclass(frozen=True, slots=True)
class LoadStatistics:
    """Result of a load test.

    `refused` viewers could not join, `dropped` ones were closed by the server. Times are milliseconds, None without
    samples; `stalls` counts blocks that arrived after their first frame was due.
    """

    viewers: int
    joined: int
    refused: int
    dropped: int
    seconds: float
    join_ms_p50: float | None
    join_ms_p99: float | None
    overlays: int
    overlay_late_ms_p50: float | None
    overlay_late_ms_p95: float | None
    overlay_late_ms_p99: float | None
    overlay_gap_ms_p99: float | None
    live_messages: int
    live_late_ms_p99: float | None
    live_gap_ms_p99: float | None
    blocks: int
    block_late_ms_p50: float | None
    block_late_ms_p95: float | None
    block_late_ms_p99: float | None
    stalls: int
    bytes_per_second: float
    why: str | None

    def as_json(self) -> dict[str, Any]:
        """Return the statistics as plain values."""
        return asdict(self)


class LoadGenerator:
    """Group of viewers of the stream at `url` (`ws://.../stream`), with an optional access `token`."""

    def __init__(self, url: str, *, single_reporter: bool = False, token: str | None = None) -> None:
        """Prepare a load test; with `single_reporter`, only one viewer sends reports."""
        self.url = url
        self.state = LoadState()
        self.viewers: list[LoadViewer] = []
        self.join_times = array("d")
        self.refused = 0
        self._single_reporter = single_reporter
        self._headers = authorization(token)
        self._requested = 0
        self._began = self._measured_from = 0.0
        self._initial_bytes = 0
        self._report_task: asyncio.Task[None] | None = None

    async def join(
        self, viewers: int, joins_per_second: float = 200.0, on_progress: Callable[[int], None] | None = None
    ) -> None:
        """Add viewers at a rate; return when all have joined or been rejected.

        `on_progress` receives the number of joined viewers. Raises `FileLimitExceeded`.
        """
        _raise_file_limit(self._requested + viewers + RESERVED_FILE_DESCRIPTORS)
        self._requested += viewers
        if self._report_task is None:
            self._report_task = asyncio.create_task(self._send_reports(), name="load test reports")
        begun = time.monotonic()
        async with asyncio.TaskGroup() as group:
            for number in range(viewers):
                await asyncio.sleep(max(begun + number / joins_per_second - time.monotonic(), 0.0))
                group.create_task(self._join_viewer(on_progress))

    async def leave(self, viewers: int) -> None:
        """Disconnect the viewers that joined last, all at once."""
        leaving, self.viewers[-viewers:] = self.viewers[-viewers:], []
        self._requested -= len(leaving)
        for viewer in leaving:
            viewer.close()
        await asyncio.sleep(0)

    def reset_statistics(self) -> None:
        """Start counting anew."""
        self._measured_from, self._initial_bytes = time.monotonic(), self.state.received_bytes
        shared = self.state
        lateness = (shared.overlay_lateness, shared.live_lateness, shared.block_lateness)
        for samples in (*lateness, shared.overlay_gaps, shared.live_gaps):
            del samples[:]
        self.state.stalls = 0

    async def close(self) -> None:
        """Disconnect all viewers."""
        if self._report_task is not None:
            self._report_task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._report_task
        await self.leave(len(self.viewers))

    def statistics(self) -> LoadStatistics:
        """Return the statistics since `reset_statistics`."""
        shared, seconds = self.state, max(time.monotonic() - self._measured_from, 1e-6)
        joins = _percentiles(self.join_times, 1e3)
        overlays, blocks = _percentiles(shared.overlay_lateness, 1e-3), _percentiles(shared.block_lateness, 1e-3)
        return LoadStatistics(
            viewers=self._requested,
            joined=len(self.viewers),
            refused=self.refused,
            dropped=sum(viewer.closed for viewer in self.viewers),
            seconds=round(seconds, 2),
            join_ms_p50=joins[0],
            join_ms_p99=joins[2],
            overlays=len(shared.overlay_lateness),
            overlay_late_ms_p50=overlays[0],
            overlay_late_ms_p95=overlays[1],
            overlay_late_ms_p99=overlays[2],
            overlay_gap_ms_p99=_percentiles(shared.overlay_gaps, 1e-3)[2],
            live_messages=len(shared.live_lateness),
            live_late_ms_p99=_percentiles(shared.live_lateness, 1e-3)[2],
            live_gap_ms_p99=_percentiles(shared.live_gaps, 1e-3)[2],
            blocks=len(shared.block_lateness),
            block_late_ms_p50=blocks[0],
            block_late_ms_p95=blocks[1],
            block_late_ms_p99=blocks[2],
            stalls=shared.stalls,
            bytes_per_second=round(
                (shared.received_bytes - self._initial_bytes) / seconds / max(len(self.viewers), 1), 1
            ),
            why=shared.error,
        )

    async def _join_viewer(self, on_progress: Callable[[int], None] | None) -> None:
        begun, viewer = time.monotonic(), LoadViewer(self.url, self.state, self._headers)
        try:
            async with asyncio.timeout(20):
                await viewer.open()
        except (OSError, TimeoutError) as error:
            self.refused += 1
            self.state.error = self.state.error or str(error) or type(error).__name__
            return
        self.viewers.append(viewer)
        self.join_times.append(time.monotonic() - begun)
        if on_progress is not None:
            on_progress(len(self.viewers))

    async def _send_reports(self) -> None:
        """Send the report of every viewer once per second, or of only one with `single_reporter`."""
        tick, due = 0, time.monotonic()
        while True:
            for viewer in self.viewers[tick % SEND_SLOTS : 1 if self._single_reporter else None : SEND_SLOTS]:
                viewer.send_report(tick // SEND_SLOTS)
            tick, due = tick + 1, due + 1 / SEND_SLOTS
            await asyncio.sleep(max(due - time.monotonic(), 0.0))


async def run_load(
    url: str,
    viewers: int,
    seconds: float,
    *,
    joins_per_second: float = 200.0,
    token: str | None = None,
    on_progress: Callable[[str, float], None] | None = None,
) -> LoadStatistics:
    """Run a load test of `viewers` on the stream at `url` for `seconds`, or until joining ends if no viewer joined.

    `on_progress` receives the stage (`joining`, `watching`) and the share done, 0..1. Raises `FileLimitExceeded`.
    """
    generator = LoadGenerator(url, token=token)
    try:
        await generator.join(
            viewers, joins_per_second, lambda joined: on_progress("joining", joined / viewers) if on_progress else None
        )
        generator.reset_statistics()
        end = time.monotonic() + seconds
        while generator.viewers and (left := end - time.monotonic()) > 0:
            if on_progress is not None:
                on_progress("watching", 1 - left / seconds)
            await asyncio.sleep(min(left, 0.2))
        return generator.statistics()
    finally:
        await generator.close()


def _raise_file_limit(sockets: int) -> None:
    """Raise this process's open-file limit as far as needed and allowed; raise `FileLimitExceeded`."""
    try:
        import resource
    except ImportError:
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft >= sockets or soft == resource.RLIM_INFINITY:
        return
    if hard != resource.RLIM_INFINITY and hard < sockets:
        raise FileLimitExceeded(
            f"the load test needs {sockets} open files, the limit is {hard}: raise it with ulimit -n"
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (sockets, hard))


def _percentiles(values: array[Any], scale: float) -> list[float | None]:
    """Return p50, p95 and p99, scaled."""
    if not values:
        return [None] * 3
    return [round(float(value) * scale, 2) for value in np.percentile(np.array(values), (50, 95, 99))]
