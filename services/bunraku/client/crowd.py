"""Many viewers of one stream in one process, to see how a server bears them.

Each is a socket of its own that takes in what a viewer is sent and says once a second what a viewer says (a ping, and a
report of what is ready ahead); nothing is decoded and nothing drawn, so that thousands fit. They keep one clock
together, as they are at one place. Latenesses are of the messages as they come: an overlay is late when it comes after
it was due, a block when it comes after its first frame should have been shown; what is in time has less than zero.
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

from bunraku.client.api import authorization
from bunraku.client.crowd_viewer import CrowdViewer, Shared

BEATS = 50
"""Parts of a second in which viewers say what they say, so that they do not say it all at once."""
SPARE = 64
"""File descriptors of the process beside the viewers'."""


class TooMany(ValueError):
    """The system lets this process open fewer sockets than are asked for."""


@dataclass(frozen=True, slots=True)
class CrowdFigures:
    """How a crowd fared. `refused` could not join, `dropped` were closed by the server; times in milliseconds, None
    where nothing of the kind came; `stalls` are blocks that came after their first frame should have been shown."""

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
    blocks: int
    block_late_ms_p50: float | None
    block_late_ms_p95: float | None
    block_late_ms_p99: float | None
    stalls: int
    bytes_per_second: float
    why: str | None

    def as_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return asdict(self)


class Crowd:
    """A crowd of viewers of the stream at `url` (a WebSocket's, `.../stream`), let in by a `token` if there is one."""

    def __init__(self, url: str, *, quiet: bool = False, token: str | None = None) -> None:
        """Of a `quiet` crowd one alone speaks; the others answer what WebSockets ask of them."""
        self.url = url
        self.shared = Shared()
        self.viewers: list[CrowdViewer] = []
        self.joins = array("d")
        self.refused = 0
        self._quiet = quiet
        self._headers = authorization(token)
        self._asked = 0
        self._began = self._counted = 0.0
        self._octets = 0
        self._talking: asyncio.Task[None] | None = None

    async def join(self, viewers: int, a_second: float = 200.0, told: Callable[[int], None] | None = None) -> None:
        """That many more, so many a second; returns when all have joined or been refused. `told` hears how many have.

        Raises `TooMany`.
        """
        _make_room(self._asked + viewers + SPARE)
        self._asked += viewers
        if self._talking is None:
            self._talking = asyncio.create_task(self._talk(), name="what a crowd says")
        begun = time.monotonic()
        async with asyncio.TaskGroup() as group:
            for number in range(viewers):
                await asyncio.sleep(max(begun + number / a_second - time.monotonic(), 0.0))
                group.create_task(self._come(told))

    async def leave(self, viewers: int) -> None:
        """That many go, the last first, all at once."""
        going, self.viewers[-viewers:] = self.viewers[-viewers:], []
        self._asked -= len(going)
        for viewer in going:
            viewer.close()
        await asyncio.sleep(0)

    def count(self) -> None:
        """Count from here on."""
        self._counted, self._octets = time.monotonic(), self.shared.octets
        for counted in (self.shared.overlays, self.shared.gaps, self.shared.blocks):
            del counted[:]
        self.shared.stalls = 0

    async def end(self) -> None:
        """Everybody goes."""
        if self._talking is not None:
            self._talking.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._talking
        await self.leave(len(self.viewers))

    def figures(self) -> CrowdFigures:
        """How it went since `count`."""
        shared, seconds = self.shared, time.monotonic() - self._counted
        joins = _percentiles(self.joins, 1e3)
        overlays, blocks = _percentiles(shared.overlays, 1e-3), _percentiles(shared.blocks, 1e-3)
        return CrowdFigures(
            viewers=self._asked,
            joined=len(self.viewers),
            refused=self.refused,
            dropped=sum(viewer.closed for viewer in self.viewers),
            seconds=round(seconds, 2),
            join_ms_p50=joins[0],
            join_ms_p99=joins[2],
            overlays=len(shared.overlays),
            overlay_late_ms_p50=overlays[0],
            overlay_late_ms_p95=overlays[1],
            overlay_late_ms_p99=overlays[2],
            overlay_gap_ms_p99=_percentiles(shared.gaps, 1e-3)[2],
            blocks=len(shared.blocks),
            block_late_ms_p50=blocks[0],
            block_late_ms_p95=blocks[1],
            block_late_ms_p99=blocks[2],
            stalls=shared.stalls,
            bytes_per_second=round((shared.octets - self._octets) / seconds / max(len(self.viewers), 1), 1),
            why=shared.why,
        )

    async def _come(self, told: Callable[[int], None] | None) -> None:
        begun, viewer = time.monotonic(), CrowdViewer(self.url, self.shared, self._headers)
        try:
            async with asyncio.timeout(20):
                await viewer.open()
        except (OSError, TimeoutError) as error:
            self.refused += 1
            self.shared.why = self.shared.why or str(error) or type(error).__name__
            return
        self.viewers.append(viewer)
        self.joins.append(time.monotonic() - begun)
        if told is not None:
            told(len(self.viewers))

    async def _talk(self) -> None:
        """Let everyone speak once a second, for ever; of a quiet crowd one, who asks for the time."""
        beat, due = 0, time.monotonic()
        while True:
            for viewer in self.viewers[beat % BEATS : 1 if self._quiet else None : BEATS]:
                viewer.speak(beat // BEATS)
            beat, due = beat + 1, due + 1 / BEATS
            await asyncio.sleep(max(due - time.monotonic(), 0.0))


async def watch_together(
    url: str,
    viewers: int,
    seconds: float,
    *,
    joins: float = 200.0,
    token: str | None = None,
    told: Callable[[str, float], None] | None = None,
) -> CrowdFigures:
    """Have `viewers` join the stream at `url`, `joins` a second, and watch for `seconds`; `told` hears what is done
    (`joining`, `watching`) and the share done, 0..1. A `token` lets them in.

    Raises `TooMany`.
    """
    crowd = Crowd(url, token=token)
    try:
        await crowd.join(viewers, joins, lambda joined: told("joining", joined / viewers) if told else None)
        crowd.count()
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if told is not None:
                told("watching", 1 - left / seconds)
            await asyncio.sleep(min(left, 0.2))
        return crowd.figures()
    finally:
        await crowd.end()


def _make_room(sockets: int) -> None:
    """Raise this process's limit of open files as far as is needed and allowed; raises `TooMany`."""
    try:
        import resource
    except ImportError:
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft >= sockets or soft == resource.RLIM_INFINITY:
        return
    if hard != resource.RLIM_INFINITY and hard < sockets:
        raise TooMany(f"this process may open {hard} files (ulimit -Hn), {sockets} are needed")
    resource.setrlimit(resource.RLIMIT_NOFILE, (sockets, hard))


def _percentiles(values: array[Any], scale: float) -> list[float | None]:
    """The 50th, 95th and 99th, in other units."""
    if not values:
        return [None] * 3
    return [round(float(value) * scale, 2) for value in np.percentile(np.array(values), (50, 95, 99))]
