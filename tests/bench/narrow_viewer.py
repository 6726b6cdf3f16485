"""Viewers at the far ends of the links of `narrow.py`, and the session they watch."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
from websockets.asyncio.client import connect

from bunraku.client import StreamEnded, Viewer
from bunraku.client.api import Client
from bunraku.client.puppeteer import Puppeteer
from bunraku.client.reconnecting_connection import SILENCE_TIMEOUT_S
from bunraku.client.viewer import FRAME_INTERVAL_S
from bunraku.playout.clock import ClockSample
from bunraku.wire.limbs import LIMBS
from bunraku.wire.messages import MAX_SERVER_MESSAGE_BYTES, SUBPROTOCOL, Ping, Pong, unpack
from bunraku.wire.overlay import Overlay
from tests.bench.network import EmulatedLink, EmulatedNetwork, FarEnd

SERVER_PORT = 18352
OVERLAY_LEAD_US = 60_000
"""Lead time of overlays: from their computation until they are due, microseconds; stated in a session's Welcome."""
LINKS = {"9k6": EmulatedLink(9_600, 150), "28k8": EmulatedLink(28_800, 75), "56k": EmulatedLink(56_000, 75)}
"""Links of telephone modems by bitrate."""
Figures = dict[str, Any]


class MeasuringViewer(Viewer):
    """Viewer that records the arrival of messages and the state at each picture."""

    def __init__(
        self,
        url: str,
        far: FarEnd | None = None,
        truth: float = 0.0,
        *,
        local_clock: Callable[[], int] | None = None,
        silence_timeout: float = SILENCE_TIMEOUT_S,
    ) -> None:
        """`truth` is the server's clock minus the monotonic clock of this machine, microseconds."""
        super().__init__(
            url,
            local_clock=local_clock,
            silence_timeout=silence_timeout,
            open_socket=far.open_socket if far else None,
        )
        self.true_clock_offset_us = truth
        self.overlay_arrivals: list[tuple[int, float, int]] = []
        """Arrival time of each overlay, its age since its newest frame was computed (ms), and its number of frames."""
        self.started_us = 0
        self.clock_errors: list[float] = []
        self.shown: list[tuple[int, int, int]] = []
        """Local time, reference time and bitrate of the shown block (-1 if none) at each picture."""
        self.audio_available: list[bool] = []
        """Availability of the sound at each picture."""

    def _on_message(self, data: bytes) -> None:
        if data and data[0] == Overlay.TYPE:
            overlay, now = Overlay.unpack(data), time.monotonic_ns() // 1000
            self.overlay_arrivals.append(
                (
                    now,
                    (now + self.true_clock_offset_us - (overlay.due - OVERLAY_LEAD_US)) / 1e3,
                    len(overlay.earlier) + 1,
                )
            )
        super()._on_message(data)

    async def watch_and_measure(self, seconds: float, frame_interval: float = FRAME_INTERVAL_S) -> None:
        """Watch for `seconds` and record the clock error and the shown block at each picture."""

        def record_picture(reference: int, _: Any) -> None:
            now = time.monotonic_ns() // 1000
            shown = self.clock.at(self._local_clock()) - (now + self.true_clock_offset_us)
            self.clock_errors.append(shown / 1e3)
            self.shown.append((now, reference, round(self._bitrate_at(reference) * 1e3)))
            self.audio_available.append(self.audio_buffered_us(reference) > 0)

        self.started_us = time.monotonic_ns() // 1000
        while (left := seconds - (time.monotonic_ns() // 1000 - self.started_us) / 1e6) > 0.5:
            try:
                await self.watch(left, record_picture, frame_interval=frame_interval)
            except StreamEnded as ended:
                print(f"a stream ended: {ended}")
                self.statistics.gaps += 1
            except (OSError, TimeoutError):
                # the link is down: no connection is possible yet
                continue


class NonReconnectingViewer(MeasuringViewer):
    """Viewer that never gives up a silent connection and waits for late messages."""

    def __init__(self, url: str, far: FarEnd | None = None, truth: float = 0.0) -> None:
        super().__init__(url, far, truth, silence_timeout=float("inf"))


class BenchContext:
    """Server at the near end, a motion on it, and the settings that every case needs."""

    def __init__(self, network: EmulatedNetwork, url: str, motion: str, truth: float) -> None:
        self.network, self.url, self.motion, self.true_clock_offset_us = network, url, motion, truth

    def create_viewer(self, far: FarEnd, path: str, *, local_clock: Callable[[], int] | None = None) -> MeasuringViewer:
        """Create a viewer at a far end."""
        url = f"ws://{far.host}:{SERVER_PORT}{path}"
        return MeasuringViewer(url, far, self.true_clock_offset_us, local_clock=local_clock)

    def create_motion_viewer(self, far: FarEnd, query: str = "") -> MeasuringViewer:
        """Create a viewer of the motion."""
        return self.create_viewer(far, f"/v1/motions/{self.motion}/stream{query}")

    async def run_controlled(self, work: Callable[[str], Awaitable[None]], angular_speed: float = 2.0) -> None:
        """Run `work` with the id of a session while all four limbs of its performer are controlled.

        The limbs swing at `angular_speed` radians per second."""
        async with Client(self.url) as client:
            session = (await client.open_session(self.motion))["id"]
            async with Puppeteer(client, session, "bench") as puppeteer:
                for limb in LIMBS:
                    await puppeteer.claim(limb)
                moving = asyncio.create_task(_move_limbs(puppeteer, angular_speed))
                try:
                    await work(session)
                finally:
                    moving.cancel()
                    await asyncio.gather(moving, return_exceptions=True)


async def _move_limbs(puppeteer: Puppeteer, angular_speed: float) -> None:
    loop = asyncio.get_running_loop()
    while True:
        phase = angular_speed * loop.time()
        swing, rise = float(np.sin(phase)), float(np.cos(1.3 * phase))
        for limb, side in zip(LIMBS[:2], (1.0, -1.0), strict=True):
            await puppeteer.target(limb, side * (0.4 + 0.2 * swing), -0.1 + 0.3 * rise, 0.5)
        for limb, side in zip(LIMBS[2:], (1.0, -1.0), strict=True):
            await puppeteer.target(limb, 0.4 + 0.3 * side * swing)
        await asyncio.sleep(1 / 60)


def round_finite(value: float) -> int | None:
    """Round to the nearest integer; None for a value that was not measured."""
    return round(value) if np.isfinite(value) else None


def percentile(values: Any, share: float) -> float:
    """Return a percentile of the values, NaN if there are none."""
    return float(np.percentile(values, share)) if len(values) else float("nan")


async def measure_clock_offset() -> float:
    """Measure the server's clock minus the monotonic clock of this machine over loopback, microseconds."""
    url = f"ws://127.0.0.1:{SERVER_PORT}"
    async with Client(url.replace("ws", "http")) as client:
        motion = (await client.motions())[0]["id"]
    best = ClockSample(0.0, 1 << 60)
    async with connect(
        f"{url}/v1/motions/{motion}/stream",
        subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
        max_size=MAX_SERVER_MESSAGE_BYTES,
    ) as connection:
        for sequence in range(100):
            sent = time.monotonic_ns() // 1000
            await connection.send(Ping(sequence, sent).pack())
            while not isinstance(pong := unpack(bytes(await connection.recv(decode=False))), Pong):
                continue
            arrived = time.monotonic_ns() // 1000
            trip = (arrived - sent) - (pong.answered - pong.received)
            if trip < best.round_trip_us:
                best = ClockSample(((pong.received - sent) + (pong.answered - arrived)) / 2, trip)
    return best.offset
