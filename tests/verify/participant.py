"""Participants of the fault tests: viewers without a screen, and a puppeteer that reconnects by itself."""

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
from bunraku.wire.live import Live
from bunraku.wire.overlay import Overlay

FRAME_S = 1 / 20
"""Interval between two pictures, seconds: short enough to detect a missing one."""


class _CloseRecorder(ReconnectingConnection):
    """Connection that records when and with which code it was closed."""

    closes: list[tuple[float, int | None]]

    async def _receive(self, connection: ClientConnection) -> None:
        try:
            await super()._receive(connection)
        finally:
            if connection.close_code is not None:
                self.closes.append((time.monotonic(), connection.close_code))


class MonitoredViewer(Viewer):
    """Viewer that records when messages arrived and how connections ended. Times are those of `time.monotonic`."""

    def __init__(self, url: str) -> None:
        super().__init__(url)
        self.message_times: list[float] = []
        self.overlay_times: list[float] = []
        self.live_times: list[float] = []
        self.dues: list[int] = []
        self.closes: list[tuple[float, int | None]] = []
        self._connection = recorder = _CloseRecorder(self._make_url, self._on_open, self._on_bytes)
        recorder.closes = self.closes
        self._task: asyncio.Task[object] | None = None

    async def start(self) -> None:
        """Start watching; return when the first pose is shown."""
        shown = asyncio.Event()
        self._task = asyncio.create_task(self.watch(86_400.0, lambda _, __: shown.set(), frame_interval=FRAME_S))
        waiting = asyncio.create_task(shown.wait())
        async with asyncio.timeout(30):
            await asyncio.wait((self._task, waiting), return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if self._task.done():
            self._task.result()

    async def stop(self) -> None:
        """Stop and disconnect."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @property
    def failure(self) -> str | None:
        """Return the error that ended the stream, None while it is running."""
        if self._task is None or not self._task.done() or self._task.cancelled():
            return None
        return repr(self._task.exception())

    def clock_error_s(self) -> float:
        """Return the difference between this viewer's motion time and that of the server's clock, seconds."""
        state = self.timeline_history.newest
        assert state is not None
        position = position_at(state, self.clock.at(time.monotonic_ns() // 1000))
        difference = abs(position - position_at(state, clock()))
        return min(difference, state.duration - difference) * 1e-6

    def longest_silence_s(self, since: float) -> float:
        """Return the longest time since `since` without a message, seconds."""
        return _longest_gap(self.message_times, since)

    def longest_overlay_gap_s(self, since: float) -> float:
        """Return the longest time since `since` without an overlay of a controlled limb, seconds."""
        return _longest_gap(self.overlay_times, since)

    def longest_live_gap_s(self, since: float) -> float:
        """Return the longest time since `since` without a pose of a live performer, seconds."""
        return _longest_gap(self.live_times, since)

    def _on_message(self, data: bytes) -> None:
        now = time.monotonic()
        self.message_times.append(now)
        if data[0] == Overlay.TYPE and data[1]:
            self.overlay_times.append(now)
        elif data[0] == Live.TYPE:
            self.live_times.append(now)
        super()._on_message(data)


class MonitoredPuppeteer:
    """Puppeteer that moves the left hand in circles at 30 Hz and reconnects whenever the connection is lost."""

    def __init__(self, client: Client, session: str, sent_inputs: int = 0) -> None:
        self._client, self._session = client, session
        self.connections = 0
        self.sent_inputs = sent_inputs
        """Inputs sent, also by the puppeteers before this one."""
        self.errors: list[tuple[float, str]] = []
        """When connections were lost, and why."""
        self._task = asyncio.create_task(self._run(), name="puppeteer")

    async def stop(self) -> None:
        """Stop and disconnect."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        while True:
            try:
                async with Puppeteer(self._client, self._session, "Aiko") as aiko:
                    await aiko.claim("left_hand")
                    self.connections += 1
                    for tick in range(1 << 30):
                        phase = tick / 30.0
                        self.sent_inputs += 1
                        await aiko.target("left_hand", 0.5, 0.2 * math.sin(phase), 0.4 + 0.1 * math.cos(phase))
                        await asyncio.sleep(1 / 30)
            except (ControlRefused, OSError, TimeoutError, WebSocketException) as error:
                self.errors.append((time.monotonic(), str(error)))
            await asyncio.sleep(0.2)


def _longest_gap(times: list[float], since: float) -> float:
    inside = [since, *(one for one in times if one > since), time.monotonic()]
    return max(after - before for before, after in pairwise(inside))
