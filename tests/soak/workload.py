"""Work of the soak test beside the viewers: a puppeteer, uploads, recordings, and sessions that come and go."""

from __future__ import annotations

import asyncio
import itertools
import math
import secrets
import tempfile
from collections import Counter
from collections.abc import Awaitable, Callable, Coroutine
from pathlib import Path
from typing import Any

import httpx2
from websockets.exceptions import WebSocketException

from bunraku.client import Client, ControlRefused, Puppeteer, ServerProblem
from bunraku.http.access_control import Role
from tests.credentials import make_token
from tests.servers import make_bvh_clip

TOKEN_LIFETIME_S = 7 * 86_400 - 3_600
UPLOAD_INTERVAL_S = 10.0
RECORDING_INTERVAL_S = 15.0
SESSION_INTERVAL_S = 3.0
OPEN_SESSIONS = 10
"""Sessions that are open at the same time, beside the one that is watched."""
RETRY_INTERVAL_S = 0.5
TRANSIENT = (ServerProblem, httpx2.TransportError, ControlRefused, OSError, TimeoutError, WebSocketException)
"""Errors of requests to a replica that has been killed."""


class Workload:
    """Work at the services whose addresses are `urls`, by service; each request goes to the next replica."""

    def __init__(self, urls: dict[str, list[str]]) -> None:
        self.counts: Counter[str] = Counter()
        """Successful and failed operations by name."""
        self.acknowledged: list[str] = []
        """Motions that a server has acknowledged and that were not deleted."""
        token = make_token(Role.ADMIN, "soak", TOKEN_LIFETIME_S)
        self._clients = {name: [Client(url, token) for url in every] for name, every in urls.items()}
        self._turns = {name: itertools.cycle(every) for name, every in self._clients.items()}
        self._tasks: list[asyncio.Task[None]] = []
        self.motion = self.session = ""

    async def start(self) -> None:
        """Open the watched session and start all work."""
        self.motion = await self._upload(20.0)
        self.session = (await next(self._turns["session"]).open_session(self.motion))["id"]
        work: tuple[Coroutine[Any, Any, None], ...] = (
            self._control(),
            self._repeat("upload", UPLOAD_INTERVAL_S, lambda: self._upload(2.0)),
            self._repeat("recording", RECORDING_INTERVAL_S, self._record),
            self._open_and_end_sessions(),
        )
        self._tasks = [asyncio.create_task(one) for one in work]

    async def stop(self) -> None:
        """Stop all work."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def close(self) -> None:
        """Close the connections."""
        for client in itertools.chain(*self._clients.values()):
            await client.__aexit__()

    async def find_lost_motions(self, newest: int | None = None) -> list[str]:
        """Return the acknowledged motions, or the `newest` of them, that are missing or incomplete."""
        lost = []
        for motion in self.acknowledged[-newest:] if newest else tuple(self.acknowledged):
            for _ in range(20):
                try:
                    described = await next(self._turns["ingest"]).motion(motion)
                    blocks = [await self._get_block(motion, index) for index in (0, described["blocks"] - 1)]
                except ServerProblem as problem:
                    if problem.status == 404:
                        lost.append(motion)
                        break
                except TRANSIENT:
                    pass
                else:
                    if not all(blocks):
                        lost.append(motion)
                    break
                # a replica is unavailable: another one must have it
                await asyncio.sleep(RETRY_INTERVAL_S)
            else:
                lost.append(motion)
        return lost

    async def _get_block(self, motion: str, index: int) -> bytes:
        response = await next(self._turns["stream"])._http.get(f"/v1/motions/{motion}/blocks/0/{index}")
        if not response.is_success:
            raise ServerProblem(response.status_code, response.json())
        return response.content

    async def _upload(self, seconds: float) -> str:
        clip = make_bvh_clip(seconds, secrets.randbelow(1 << 30))
        with tempfile.TemporaryDirectory(prefix="bunraku-soak-") as folder:
            path = Path(folder) / "soak.bvh"
            path.write_bytes(clip)
            motion = str((await next(self._turns["ingest"]).upload(path))["id"])
        self.acknowledged.append(motion)
        return motion

    async def _record(self) -> None:
        recorded = await next(self._turns["session"]).record(self.session, "soak", 2.0)
        self.acknowledged.append(str(recorded["id"]))

    async def _repeat(self, name: str, interval_s: float, operation: Callable[[], Awaitable[object]]) -> None:
        while True:
            try:
                await operation()
                self.counts[name] += 1
            except TRANSIENT as error:
                self._count_failure(name, error)
            await asyncio.sleep(interval_s)

    def _count_failure(self, name: str, error: Exception) -> None:
        reason = error.status if isinstance(error, ServerProblem) else type(error).__name__
        self.counts[f"failed {name}: {reason}"] += 1

    async def _open_and_end_sessions(self) -> None:
        opened: list[str] = []
        while True:
            try:
                opened.append((await next(self._turns["session"]).open_session(self.motion))["id"])
                self.counts["session"] += 1
                while len(opened) > OPEN_SESSIONS:
                    await self._end_session(opened[0])
                    opened.pop(0)
            except TRANSIENT as error:
                self._count_failure("session", error)
            await asyncio.sleep(SESSION_INTERVAL_S)

    async def _end_session(self, session: str) -> None:
        try:
            await next(self._turns["session"])._request("DELETE", f"/v1/sessions/{session}")
        except ServerProblem as problem:
            # an earlier attempt has ended it, but its response was lost
            if problem.status != 404:
                raise

    async def _control(self) -> None:
        """Move the left hand; reconnect through the next replica whenever the connection is lost."""
        while True:
            try:
                async with Puppeteer(next(self._turns["session"]), self.session, "soak") as puppeteer:
                    await puppeteer.claim("left_hand")
                    self.counts["puppeteer"] += 1
                    for tick in itertools.count():
                        phase = tick / 30.0
                        await puppeteer.target("left_hand", 0.5, 0.2 * math.sin(phase), 0.4 + 0.1 * math.cos(phase))
                        await asyncio.sleep(1 / 30)
            except TRANSIENT:
                await asyncio.sleep(RETRY_INTERVAL_S)
