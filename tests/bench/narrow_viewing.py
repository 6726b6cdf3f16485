"""The viewers at the far ends of `narrow.py`'s lines, and the session they watch."""

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
from bunraku.playout.clock import Sample
from bunraku.wire.limbs import LIMBS
from bunraku.wire.messages import LARGEST_FROM_SERVER, SUBPROTOCOL, Ping, Pong, unpack
from bunraku.wire.overlay import Overlay
from tests.bench.network import Far, Link, Network

PORT = 18352
LEAD = 60_000
"""How far ahead of its making an overlay is due, microseconds; a session's Welcome says it."""
LINES = {"9k6": Link(9_600, 150), "28k8": Link(28_800, 75), "56k": Link(56_000, 75)}
"""The lines of old telephones, by their kbit/s."""
Figures = dict[str, Any]


class Screen(Viewer):
    """A viewer that remembers when what came."""

    def __init__(self, url: str, far: Far | None = None, truth: float = 0.0, **options: Any) -> None:
        """`truth` is the server's clock minus this machine's monotonic one, microseconds."""
        super().__init__(url, open_socket=far.open_socket if far else None, **options)
        self.truth = truth
        self.came: list[tuple[int, float, int]] = []
        """When each overlay came, how late after its newest frame was made (ms), and how many frames it had."""
        self.begun = 0
        self.clock_errors: list[float] = []
        self.shown: list[tuple[int, int, int]] = []
        """Of each picture: local time, reference time, rate of the block shown or -1."""
        self.heard: list[bool] = []
        """Of each picture: whether the sound that goes with it was there."""

    def _take(self, data: bytes) -> None:
        if data and data[0] == Overlay.TYPE:
            overlay, now = Overlay.unpack(data), time.monotonic_ns() // 1000
            self.came.append((now, (now + self.truth - (overlay.due - LEAD)) / 1e3, len(overlay.earlier) + 1))
        super()._take(data)

    async def look(self, seconds: float, **options: Any) -> None:
        """Watch, and note how far the clock is off at each picture once it was told the time well."""

        def picture(reference: int, _: Any) -> None:
            now = time.monotonic_ns() // 1000
            shown = self.clock.at(self._local()) - (now + self.truth)
            self.clock_errors.append(shown / 1e3)
            self.shown.append((now, reference, round(self._kbps_at(reference) * 1e3)))
            self.heard.append(self.audio_ahead(reference) > 0)

        self.begun = time.monotonic_ns() // 1000
        while (left := seconds - (time.monotonic_ns() // 1000 - self.begun) / 1e6) > 0.5:
            try:
                await self.watch(left, picture, **options)
            except StreamEnded as ended:
                print(f"a stream ended: {ended}")
                self.figures.gaps += 1
            except (OSError, TimeoutError):
                # the line does not carry a connection yet
                continue


class Patient(Screen):
    """One that waits for what comes late, however late."""

    def __init__(self, url: str, far: Far | None = None, truth: float = 0.0) -> None:
        super().__init__(url, far, truth, silent=float("inf"))


class Bench:
    """The server at the near end, a motion in it, and what every case needs."""

    def __init__(self, net: Network, url: str, motion: str, truth: float) -> None:
        self.net, self.url, self.motion, self.truth = net, url, motion, truth

    def screen(self, far: Far, path: str, **options: Any) -> Screen:
        """A viewer at a far end."""
        return Screen(f"ws://{far.host}:{PORT}{path}", far, self.truth, **options)

    def dance(self, far: Far, query: str = "", **options: Any) -> Screen:
        """A viewer of the motion."""
        return self.screen(far, f"/v1/motions/{self.motion}/stream{query}", **options)

    async def pulled(self, work: Callable[[str], Awaitable[None]], pace: float = 2.0) -> None:
        """`work`, told the id of a session whose dancer is pulled about by all four limbs meanwhile, at `pace` radians
        of their swing a second."""
        async with Client(self.url) as client:
            session = (await client.open_session(self.motion))["id"]
            async with Puppeteer(client, session, "bench") as puppeteer:
                for limb in LIMBS:
                    await puppeteer.claim(limb)
                pulling = asyncio.create_task(_pull(puppeteer, pace))
                try:
                    await work(session)
                finally:
                    pulling.cancel()
                    await asyncio.gather(pulling, return_exceptions=True)


async def _pull(puppeteer: Puppeteer, pace: float) -> None:
    loop = asyncio.get_running_loop()
    while True:
        phase = pace * loop.time()
        swing, rise = float(np.sin(phase)), float(np.cos(1.3 * phase))
        for limb, side in zip(LIMBS[:2], (1.0, -1.0), strict=True):
            await puppeteer.target(limb, side * (0.4 + 0.2 * swing), -0.1 + 0.3 * rise, 0.5)
        for limb, side in zip(LIMBS[2:], (1.0, -1.0), strict=True):
            await puppeteer.target(limb, 0.4 + 0.3 * side * swing)
        await asyncio.sleep(1 / 60)


def whole(value: float) -> int | None:
    """To the nearest one; None for what did not come."""
    return round(value) if np.isfinite(value) else None


def percentile(values: Any, share: float) -> float:
    """NaN of nothing."""
    return float(np.percentile(values, share)) if len(values) else float("nan")


async def truth_of_the_clock() -> float:
    """The server's clock minus this machine's monotonic one, microseconds, over the loopback."""
    url = f"ws://127.0.0.1:{PORT}"
    async with Client(url.replace("ws", "http")) as client:
        motion = (await client.motions())[0]["id"]
    best = Sample(0.0, 1 << 60)
    async with connect(
        f"{url}/v1/motions/{motion}/stream",
        subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
        max_size=LARGEST_FROM_SERVER,
    ) as connection:
        for sequence in range(100):
            sent = time.monotonic_ns() // 1000
            await connection.send(Ping(sequence, sent).pack())
            while not isinstance(pong := unpack(bytes(await connection.recv(decode=False))), Pong):
                continue
            arrived = time.monotonic_ns() // 1000
            trip = (arrived - sent) - (pong.answered - pong.received)
            if trip < best.trip:
                best = Sample(((pong.received - sent) + (pong.answered - arrived)) / 2, trip)
    return best.offset
