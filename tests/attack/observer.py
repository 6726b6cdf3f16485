"""Calm viewers and the puppeteer of a session, in a separate process: `python -m tests.attack.observer`.

The first line of standard input is a JSON object: `url`, `session`, `viewers` and `tokens` with a `view` and a
`control` token. The process answers with one line when overlays of the controlled limb arrive. Then each line is a
command: `mark` starts a window; `gaps` answers with the gaps between overlays since then. A viewer that the server
disconnects reconnects, and is counted.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
import time
from array import array
from typing import Any

import numpy as np
import uvloop

from bunraku.client.api import Client
from bunraku.client.authorization import authorization
from bunraku.client.message_socket import MessageSocket
from bunraku.wire.messages import Ping
from bunraku.wire.overlay import Overlay
from tests.verify.participant import MonitoredPuppeteer

START_TIMEOUT_S = 60.0
PING_INTERVAL_S = 1.0
RECONNECT_INTERVAL_S = 0.5


class Window:
    """Gaps between overlays of a controlled limb since a mark, of all viewers, in seconds."""

    def __init__(self) -> None:
        self.gaps = array("d")
        self.dropped = 0


class CalmViewer(MessageSocket):
    """Viewer that records when overlays of a controlled limb arrive."""

    __slots__ = ("_window", "last_overlay_at")

    def __init__(self, url: str, token: str, window: Window, last_overlay_at: float) -> None:
        super().__init__(url, authorization(token))
        self._window = window
        self.last_overlay_at = last_overlay_at

    def on_message(self, message: bytes) -> None:
        if message[0] == Overlay.TYPE and message[1] & 15:
            now = time.monotonic()
            self._window.gaps.append(now - self.last_overlay_at)
            self.last_overlay_at = now


class Audience:
    """Group of viewers that stay connected. A gap goes on over a reconnect."""

    def __init__(self, url: str, token: str, count: int) -> None:
        self.window = Window()
        self._url, self._token = url, token
        self._viewers: list[CalmViewer | None] = [None] * count
        self._tasks: list[asyncio.Task[None]] = []

    async def start(self) -> None:
        """Connect all viewers."""
        self._tasks = [asyncio.create_task(self._keep_connected(number)) for number in range(len(self._viewers))]

    async def stop(self) -> None:
        """Disconnect all viewers."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def mark(self) -> None:
        """Start a new window."""
        del self.window.gaps[:]
        self.window.dropped = 0
        now = time.monotonic()
        for viewer in self._viewers:
            if viewer is not None:
                viewer.last_overlay_at = now

    def describe_gaps(self) -> dict[str, Any]:
        """Return the gaps since the mark in ms, with those that have not ended."""
        now = time.monotonic()
        gaps = np.array([*self.window.gaps, *(now - one.last_overlay_at for one in self._viewers if one is not None)])
        p50, p99 = np.percentile(gaps, (50, 99)) * 1e3
        return {
            "p50": round(float(p50), 1),
            "p99": round(float(p99), 1),
            "max": round(float(gaps.max()) * 1e3, 1),
            "overlays": len(self.window.gaps),
            "dropped": self.window.dropped,
        }

    async def _keep_connected(self, number: int) -> None:
        last_overlay_at = time.monotonic()
        while True:
            viewer = CalmViewer(self._url, self._token, self.window, last_overlay_at)
            with contextlib.suppress(OSError, TimeoutError):
                await asyncio.wait_for(viewer.open(), 20.0)
                self._viewers[number] = viewer
                sequence = 0
                try:
                    while not viewer.closed:
                        viewer.send(Ping(sequence, time.monotonic_ns() // 1000).pack())
                        sequence += 1
                        await asyncio.sleep(PING_INTERVAL_S)
                finally:
                    viewer.close()
                self.window.dropped += 1
                last_overlay_at = viewer.last_overlay_at
            await asyncio.sleep(RECONNECT_INTERVAL_S)


async def observe(url: str, session: str, viewers: int, tokens: dict[str, str]) -> None:
    """Watch and control a session, and execute the commands of standard input until it ends."""
    async with Client(url, tokens["control"]) as client:
        puppeteer = MonitoredPuppeteer(client, session)
        audience = Audience(client.socket_url(f"/v1/sessions/{session}/stream"), tokens["view"], viewers)
        await audience.start()
        try:
            async with asyncio.timeout(START_TIMEOUT_S):
                while len(audience.window.gaps) < 20 * viewers:  # noqa: ASYNC110
                    await asyncio.sleep(0.05)
            print("ready", flush=True)
            while command := (await asyncio.to_thread(sys.stdin.readline)).strip():
                answer: dict[str, Any] = {}
                if command == "mark":
                    audience.mark()
                else:
                    answer = audience.describe_gaps()
                print(json.dumps(answer), flush=True)
        finally:
            await audience.stop()
            await puppeteer.stop()


def run_first() -> None:
    """Run before the other processes where that is permitted: viewers have machines of their own."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))


if __name__ == "__main__":
    run_first()
    uvloop.run(observe(**json.loads(sys.stdin.readline())))
