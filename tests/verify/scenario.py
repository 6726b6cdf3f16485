"""What goes on while things break: two viewers on different replicas, a puppeteer who comes through a session replica
that is not the stage's, and what the stack has acknowledged so far."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx2

from bunraku.client.api import Client, ServerProblem
from tests.servers import make_bvh_clip
from tests.verify.participant import MonitoredPuppeteer, MonitoredViewer
from tests.verify.stack import Stack

PROBE_SOURCE = (Path(__file__).parent / "container_probe.py").read_bytes()
MAX_SILENCE_S = 5.0
"""Seconds within which viewers go on."""
MAX_CLOCK_ERROR_S = 0.1
"""Seconds by which the dance may be off."""
_OPEN_SESSION_SCRIPT = """
import json, sys, urllib.request
kind = {"Content-Type": "application/json"}
asked = urllib.request.Request("http://127.0.0.1:8000/v1/sessions", sys.argv[1].encode(), kind)
print(urllib.request.urlopen(asked, timeout=20).read().decode())
"""


class Scenario:
    """One session, its people, and what must not be lost."""

    def __init__(self, stack: Stack, client: Client, motion: str, session: str) -> None:
        self.stack, self.client, self.motion, self.session = stack, client, motion, session
        self.acknowledged: list[str] = [motion]
        self.viewers: list[MonitoredViewer] = []
        self.puppeteer: MonitoredPuppeteer

    async def upload_motion(self, folder: Path, seconds: float = 1.0) -> str:
        """A new motion, acknowledged."""
        source = folder / f"{secrets.token_hex(4)}.bvh"
        source.write_bytes(make_bvh_clip(seconds, secrets.randbelow(1 << 30)))
        made = (await self.client.upload(source))["id"]
        self.acknowledged.append(made)
        return str(made)

    async def record_motion(self) -> None:
        """What was shown last becomes a motion, acknowledged."""
        self.acknowledged.append((await self.client.record(self.session, "kept", 1.0))["id"])

    async def find_lost_motions(self) -> list[str]:
        """What was acknowledged and is not there, or not whole."""
        missing = []
        async with httpx2.AsyncClient(base_url=self.stack.url, timeout=10.0) as http:
            for motion in self.acknowledged:
                described = await http.get(f"/v1/motions/{motion}")
                blocks = described.json().get("blocks", 1) if described.status_code == 200 else 1
                asked = [http.get(f"/v1/motions/{motion}/blocks/0/{index}") for index in (0, blocks - 1)]
                answers = [described, *await asyncio.gather(*asked)]
                if any(answer.status_code != 200 for answer in answers):
                    missing.append(f"{motion} {[answer.status_code for answer in answers]}")
        return missing

    async def find_owner_replica(self) -> int:
        """The number of the session replica that has the stage: the first, until another says that it took it over."""
        taken = f"session {self.session} was left"
        said = [await self.stack.last_logged("session", number, taken) for number in (1, 2)]
        return said.index(max(said)) + 1

    async def count_inputs(self) -> dict[str, int]:
        """Inputs applied to the puppet, and those a second time, by the session's own log."""
        said: dict[str, int] = json.loads(
            await self.stack.exec_in_replica("session", 1, "python", "-", self.session, stdin=PROBE_SOURCE)
        )
        return said

    async def wait_for_overlays(self, since: float, seconds: float = 30.0) -> bool:
        """Wait until both viewers see a pulled limb again, with what they heard after `since`; whether they do."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now = time.monotonic()
            if all(one.overlay_times and one.overlay_times[-1] > max(since, now - 0.4) for one in self.viewers):
                return True
            await asyncio.sleep(0.05)
        return False

    def evaluate(self, since: float) -> tuple[dict[str, float], list[str]]:
        """How viewers fared from `since` to now, and what did not hold."""
        silence = max(one.longest_silence_s(since) for one in self.viewers)
        off = max(one.clock_error_s() for one in self.viewers)
        figures = {
            "resume_s": silence,
            "pull_s": max(one.longest_overlay_gap_s(since) for one in self.viewers),
            "off_ms": off * 1e3,
        }
        broken = [f"a viewer gave up: {one.failure}" for one in self.viewers if one.failure is not None]
        if silence > MAX_SILENCE_S:
            broken.append(f"viewers heard nothing for {silence:.1f} s")
        if off > MAX_CLOCK_ERROR_S:
            broken.append(f"the dance was {off:.3f} s off")
        return figures, broken


@asynccontextmanager
async def open_scenario(stack: Stack, motion: str) -> AsyncIterator[Scenario]:
    """A scene over a motion: the session is the first replica's, its puppeteer comes through another."""
    body = json.dumps({"motion": motion, "loop": True})
    said = await stack.exec_in_replica("session", 1, "python", "-c", _OPEN_SESSION_SCRIPT, body)
    session = json.loads(said)["id"]
    async with Client(stack.url) as client:
        scene = Scenario(stack, client, motion, session)
        try:
            address = client.socket_url(f"/v1/sessions/{session}/stream")
            await _spread_viewers(scene, address)
            await connect_through_other_replica(scene)
            assert await scene.wait_for_overlays(time.monotonic()), "the pulled limb is not seen"
            yield scene
        finally:
            if hasattr(scene, "puller"):
                await scene.puppeteer.stop()
            await asyncio.gather(*(one.stop() for one in scene.viewers))
            with contextlib.suppress(ServerProblem, httpx2.TransportError):
                await asyncio.wait_for(_delete_session(client, session), 10.0)


async def _delete_session(client: Client, session: str) -> None:
    response = await client._http.delete(f"/v1/sessions/{session}")
    response.raise_for_status()


async def _spread_viewers(scene: Scenario, address: str) -> None:
    """Two viewers on different replicas of the stream service."""
    taken: int | None = None
    for _ in range(20):
        before = await scene.stack.count_connections("stream")
        watcher = MonitoredViewer(address)
        await watcher.start()
        after = await scene.stack.count_connections("stream")
        grown = [number for number in range(2) if after[number] > before[number]]
        if len(grown) == 1 and grown[0] != taken:
            taken = grown[0]
            scene.viewers.append(watcher)
            if len(scene.viewers) == 2:
                return
        else:
            await watcher.stop()
    raise AssertionError("two viewers do not come to different replicas")


async def connect_through_other_replica(scene: Scenario) -> None:
    """The puppeteer comes through a session replica that has not the stage."""
    owner = await scene.find_owner_replica()
    for _ in range(20):
        if hasattr(scene, "puller"):
            await scene.puppeteer.stop()
        before = await scene.stack.count_connections("session")
        scene.puppeteer = MonitoredPuppeteer(scene.client, scene.session)
        async with asyncio.timeout(30):
            while not scene.puppeteer.connections:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        after = await scene.stack.count_connections("session")
        if after[2 - owner] > before[2 - owner] and after[owner - 1] <= before[owner - 1]:
            return
    raise AssertionError("no puppeteer comes through the other replica")
