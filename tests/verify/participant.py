"""Those who are there while things break: viewers without a screen, and a puppeteer who comes again by itself."""

from __future__ import annotations

import asyncio
import math
import time
from itertools import pairwise

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import WebSocketException

from bunraku.client.api import Client
from bunraku.client.puppeteer import ControlRefused, Puppeteer
from bunraku.client.reconnecting_connection import ReconnectingConnection
from bunraku.client.viewer import Viewer
from bunraku.playout.timeline import position_at
from bunraku.runtime.clock import clock
from bunraku.wire.overlay import Overlay

FRAME_S = 1 / 20
"""Seconds between two pictures: enough to see whether one is missing."""


class _CloseRecorder(ReconnectingConnection):
    """A line of which it is noted when and how its connections were closed."""

    closes: list[tuple[float, int | None]]

    async def _listen(self, connection: ClientConnection) -> None:
        try:
            await super()._receive(connection)
        finally:
            if connection.close_code is not None:
                self.closes.append((time.monotonic(), connection.close_code))


class MonitoredViewer(Viewer):
    """A viewer who notes when something was heard, and how connections ended. Times are of `time.monotonic`."""

    def __init__(self, url: str) -> None:
        super().__init__(url)
        self.message_times: list[float] = []
        self.overlay_times: list[float] = []
        self.dues: list[int] = []
        self.closes: list[tuple[float, int | None]] = []
        self._line = noted = _CloseRecorder(self._make_url, self._on_open, self._on_bytes)
        noted.closes = self.closes
        self._task: asyncio.Task[object] | None = None

    async def start(self) -> None:
        """Watch until `stop`; returns once something is shown."""
        shown = asyncio.Event()
        self._task = asyncio.create_task(self.watch(86_400.0, lambda _, __: shown.set(), frame_interval=FRAME_S))
        waiting = asyncio.create_task(shown.wait())
        async with asyncio.timeout(30):
            await asyncio.wait((self._task, waiting), return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if self._task.done():
            self._task.result()

    async def stop(self) -> None:
        """Go."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @property
    def failure(self) -> str | None:
        """Why the stream was given up, None while it goes on."""
        if self._task is None or not self._task.done() or self._task.cancelled():
            return None
        return repr(self._task.exception())

    def clock_error_s(self) -> float:
        """Seconds by which the dance here is off where the stage's clock has it."""
        state = self.timeline_history.newest
        assert state is not None
        here = position_at(state, self.clock.at(time.monotonic_ns() // 1000))
        apart = abs(here - position_at(state, clock()))
        return min(apart, state.duration - apart) * 1e-6

    def longest_silence_s(self, since: float) -> float:
        """The longest time from `since` to now in which nothing was heard, seconds."""
        return _longest_gap(self.message_times, since)

    def longest_overlay_gap_s(self, since: float) -> float:
        """The longest time from `since` to now without a pulled limb."""
        return _longest_gap(self.overlay_times, since)

    def _take(self, data: bytes) -> None:
        now = time.monotonic()
        self.message_times.append(now)
        if data[0] == Overlay.TYPE and data[1]:
            self.overlay_times.append(now)
        super()._on_message(data)


class MonitoredPuppeteer:
    """A puppeteer who leads the left hand round, thirty times a second, and comes again whenever the line is lost."""

    def __init__(self, client: Client, session: str) -> None:
        self._client, self._session = client, session
        self.connections = 0
        self.errors: list[tuple[float, str]] = []
        """Why the line was lost, and when."""
        self._task = asyncio.create_task(self._run(), name="puppeteer")

    async def stop(self) -> None:
        """Go."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        while True:
            try:
                async with Puppeteer(self._client, self._session, "Aiko") as aiko:
                    await aiko.claim("left_hand")
                    self.connections += 1
                    for tick in range(1 << 30):
                        turn = tick / 30.0
                        await aiko.target("left_hand", 0.5, 0.2 * math.sin(turn), 0.4 + 0.1 * math.cos(turn))
                        await asyncio.sleep(1 / 30)
            except (ControlRefused, OSError, TimeoutError, WebSocketException) as error:
                self.errors.append((time.monotonic(), str(error)))
            await asyncio.sleep(0.2)


def _longest_gap(times: list[float], since: float) -> float:
    inside = [since, *(one for one in times if one > since), time.monotonic()]
    return max(after - before for before, after in pairwise(inside))
