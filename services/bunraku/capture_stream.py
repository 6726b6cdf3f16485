"""Streaming of a live capture: a performer on the stage of a server, and the poses sent to it."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple
from urllib.parse import quote

import httpx2
from websockets.exceptions import WebSocketException

from bunraku.capture.session import TimedPose
from bunraku.client.api import Client
from bunraku.client.performer import Performer
from bunraku.client.reconnecting_connection import StreamEnded
from bunraku.client.server_problem import ServerProblem
from bunraku.motion.skeleton import Figure
from bunraku.wire.live import Sample

MIN_STREAM_FPS, MAX_STREAM_FPS = 10.0, 240.0
"""Range of the poses per second that a server accepts."""
MAX_QUEUED_POSES = 128
"""Poses that wait while the connection is not writable; then the oldest are dropped."""
DESCRIBE_INTERVAL_S = 2.0
"""Interval at which the server is asked for the delay."""
RETRY_INTERVAL_S = 1.0
"""Time until another stage is opened in place of one that was lost."""
SAMPLE_BYTES = Sample.LAYOUT.size + 8
"""Size of a sample with the header of its WebSocket frame."""


class StreamOptions(NamedTuple):
    """Options of a performance on a server."""

    server: str
    token: str | None
    session: str | None
    """Id of the session to join; None: a new one."""
    name: str
    fps: float
    """Poses per second that are expected."""
    place: tuple[float, float, float] | None
    """x and z in metres and the turn about y in degrees; None: the next free place."""


class PerformanceStream:
    """Performance on a server. Poses are sent while there is a connection, and dropped otherwise."""

    def __init__(self, options: StreamOptions, on_live: Callable[[str], object] = lambda _: None) -> None:
        """`on_live` is called with the address of the stage, each time that the performer is on one."""
        self.problem: str | None = None
        """Reason for which the performance has ended."""
        self.sent = 0
        """Poses sent."""
        self.dropped = 0
        """Poses that were not sent, as the connection was lost or too slow."""
        self._options = options
        self._on_live = on_live
        self._poses: asyncio.Queue[TimedPose] = asyncio.Queue(MAX_QUEUED_POSES)
        self._performer: Performer | None = None
        self._is_live = asyncio.Event()
        self._live_since_s = 0.0
        self._reconnects_before = 0
        self._delay_us: int | None = None

    async def check(self) -> None:
        """Raise `ServerProblem` or `httpx2.TransportError` if the session is unknown or the server unreachable."""
        async with self._open_client() as client:
            if self._options.session is not None:
                await client.session(self._options.session)
            else:
                await client.health()

    def offer(self, poses: Sequence[TimedPose]) -> None:
        """Send poses, once the performer is on the stage."""
        if not self._is_live.is_set():
            return
        for pose in poses:
            if self._poses.full():
                self._poses.get_nowait()
                self._poses.task_done()
                self.dropped += 1
            self._poses.put_nowait(pose)

    async def wait_until_live(self) -> None:
        """Wait until the performer is on the stage."""
        await self._is_live.wait()

    async def wait_until_sent(self) -> None:
        """Wait until the poses offered so far are sent."""
        if self._is_live.is_set():
            await self._poses.join()

    async def run(self, figure: Figure) -> None:
        """Bring a performer on the stage and send its poses, until cancelled.

        An error ends the performance and is kept as `problem`.
        """
        try:
            async with self._open_client() as client:
                while True:
                    await self._perform(client, figure)
                    await asyncio.sleep(RETRY_INTERVAL_S)
        except ServerProblem as problem:
            self.problem = str(problem)
        except StreamEnded as ended:
            self.problem = f"The performance has ended: {ended}"
        except (httpx2.TransportError, OSError, WebSocketException) as error:
            self.problem = f"Cannot reach Bunraku at {self._options.server}: {error}"

    def describe(self, poses_per_s: float) -> str:
        """Return the state in words."""
        if self._performer is None:
            return "joining the stage"
        if not self._performer.is_connected:
            return "connection to the server lost: connecting again"
        words = [f"{poses_per_s * SAMPLE_BYTES * 8e-3:.0f} kbit/s"]
        if self._delay_us is not None:
            words.append(f"delay {self._delay_us / 1e3:.0f} ms")
        if math.isfinite(bound := self._performer.clock.error_bound):
            words.append(f"round trip {2e-3 * bound:.0f} ms")
        return ", ".join(words)

    def statistics(self) -> dict[str, Any]:
        """Return the counts, and the ids of what was made."""
        performer = self._performer
        description = performer.description if performer is not None else {}
        seconds = time.monotonic() - self._live_since_s if performer is not None else 0.0
        return {
            "session": description.get("session"),
            "performer": description.get("performer"),
            "motion": description.get("motion"),
            "page": self._page(),
            "live_seconds": round(seconds, 3),
            "sent": self.sent,
            "dropped": self.dropped,
            "kbps": round(self.sent * SAMPLE_BYTES * 8e-3 / seconds, 1) if seconds > 0.0 else 0.0,
            "delay_ms": None if self._delay_us is None else round(self._delay_us / 1e3, 1),
            "reconnects": self._reconnects_before + (performer.reconnects if performer is not None else 0),
        }

    async def _perform(self, client: Client, figure: Figure) -> None:
        """Perform until cancelled. Return when the stage is gone and another may be opened; raise all other errors."""
        options = self._options
        place = options.place and (options.place[0], options.place[1], math.radians(options.place[2]))
        performer = client.perform(
            figure, name=options.name, session=options.session, fps=options.fps, place=place or None
        )
        try:
            async with performer:
                self._start(performer)
                tasks = [asyncio.create_task(work(performer)) for work in (self._send, self._describe)]
                try:
                    await performer.wait_until_ended()
                finally:
                    self._is_live.clear()
                    for task in tasks:
                        task.cancel()
                    await asyncio.gather(*tasks, return_exceptions=True)
        except StreamEnded:
            if not await self._is_stage_lost(client):
                raise

    def _start(self, performer: Performer) -> None:
        if self._performer is None:
            self._live_since_s = time.monotonic()
        else:
            self._reconnects_before += self._performer.reconnects + 1
        self._performer = performer
        self._is_live.set()
        self._on_live(self._page() or "")

    async def _send(self, performer: Performer) -> None:
        while True:
            time_s, pose = await self._poses.get()
            if performer.is_connected:
                self.sent += 1
                await performer.frame((pose.root, pose.rotations), time_s)
            else:
                self.dropped += 1
            self._poses.task_done()

    async def _describe(self, performer: Performer) -> None:
        while True:
            with contextlib.suppress(ServerProblem, httpx2.TransportError):
                self._delay_us = (await performer.describe()).get("delay")
            await asyncio.sleep(DESCRIBE_INTERVAL_S)

    async def _is_stage_lost(self, client: Client) -> bool:
        """Return whether the stage was our own and is gone, as after a restart of a server without a bus."""
        if self._options.session is not None or self._performer is None:
            return False
        try:
            await client.session(self._performer.session)
        except ServerProblem as problem:
            return problem.status == 404
        return False

    def _open_client(self) -> Client:
        return Client(self._options.server, self._options.token)

    def _page(self) -> str | None:
        """Return the address at which the stage is watched."""
        if self._performer is None:
            return None
        return f"{self._options.server.rstrip('/')}/?session={quote(self._performer.session, safe='')}"
