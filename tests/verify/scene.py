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
from tests.servers import clip
from tests.verify.people import Puller, Watcher
from tests.verify.stack import Stack

INSIDE = (Path(__file__).parent / "inside.py").read_bytes()
RESUMED = 5.0
"""Seconds within which viewers go on."""
OFF = 0.1
"""Seconds by which the dance may be off."""
_OPEN = """
import json, sys, urllib.request
kind = {"Content-Type": "application/json"}
asked = urllib.request.Request("http://127.0.0.1:8000/v1/sessions", sys.argv[1].encode(), kind)
print(urllib.request.urlopen(asked, timeout=20).read().decode())
"""


class Scene:
    """One session, its people, and what must not be lost."""

    def __init__(self, stack: Stack, client: Client, motion: str, session: str) -> None:
        self.stack, self.client, self.motion, self.session = stack, client, motion, session
        self.acknowledged: list[str] = [motion]
        self.watchers: list[Watcher] = []
        self.puller: Puller

    async def upload(self, folder: Path, seconds: float = 1.0) -> str:
        """A new motion, acknowledged."""
        source = folder / f"{secrets.token_hex(4)}.bvh"
        source.write_bytes(clip(seconds, secrets.randbelow(1 << 30)))
        made = (await self.client.upload(source))["id"]
        self.acknowledged.append(made)
        return str(made)

    async def keep(self) -> None:
        """What was shown last becomes a motion, acknowledged."""
        self.acknowledged.append((await self.client.keep(self.session, "kept", 1.0))["id"])

    async def lost(self) -> list[str]:
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

    async def owner(self) -> int:
        """The number of the session replica that has the stage: the first, until another says that it took it over."""
        taken = f"session {self.session} was left"
        said = [await self.stack.logged("session", number, taken) for number in (1, 2)]
        return said.index(max(said)) + 1

    async def inputs(self) -> dict[str, int]:
        """Inputs applied to the puppet, and those a second time, by the session's own log."""
        said: dict[str, int] = json.loads(
            await self.stack.inside("session", 1, "python", "-", self.session, given=INSIDE)
        )
        return said

    async def flows(self, since: float, seconds: float = 30.0) -> bool:
        """Wait until both viewers see a pulled limb again, with what they heard after `since`; whether they do."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now = time.monotonic()
            if all(one.pulled and one.pulled[-1] > max(since, now - 0.4) for one in self.watchers):
                return True
            await asyncio.sleep(0.05)
        return False

    def judge(self, since: float) -> tuple[dict[str, float], list[str]]:
        """How viewers fared from `since` to now, and what did not hold."""
        silence = max(one.silence(since) for one in self.watchers)
        off = max(one.off() for one in self.watchers)
        figures = {
            "resume_s": silence,
            "pull_s": max(one.unpulled(since) for one in self.watchers),
            "off_ms": off * 1e3,
        }
        broken = [f"a viewer gave up: {one.ended}" for one in self.watchers if one.ended is not None]
        if silence > RESUMED:
            broken.append(f"viewers heard nothing for {silence:.1f} s")
        if off > OFF:
            broken.append(f"the dance was {off:.3f} s off")
        return figures, broken


@asynccontextmanager
async def opened(stack: Stack, motion: str) -> AsyncIterator[Scene]:
    """A scene over a motion: the session is the first replica's, its puppeteer comes through another."""
    body = json.dumps({"motion": motion, "loop": True})
    said = await stack.inside("session", 1, "python", "-c", _OPEN, body)
    session = json.loads(said)["id"]
    async with Client(stack.url) as client:
        scene = Scene(stack, client, motion, session)
        try:
            address = client.socket_url(f"/v1/sessions/{session}/stream")
            await _apart(scene, address)
            await through_another(scene)
            assert await scene.flows(time.monotonic()), "the pulled limb is not seen"
            yield scene
        finally:
            if hasattr(scene, "puller"):
                await scene.puller.stop()
            await asyncio.gather(*(one.stop() for one in scene.watchers))
            with contextlib.suppress(ServerProblem, httpx2.TransportError):
                await asyncio.wait_for(_end(client, session), 10.0)


async def _end(client: Client, session: str) -> None:
    response = await client._http.delete(f"/v1/sessions/{session}")
    response.raise_for_status()


async def _apart(scene: Scene, address: str) -> None:
    """Two viewers on different replicas of the stream service."""
    taken: int | None = None
    for _ in range(20):
        before = await scene.stack.connected("stream")
        watcher = Watcher(address)
        await watcher.start()
        after = await scene.stack.connected("stream")
        grown = [number for number in range(2) if after[number] > before[number]]
        if len(grown) == 1 and grown[0] != taken:
            taken = grown[0]
            scene.watchers.append(watcher)
            if len(scene.watchers) == 2:
                return
        else:
            await watcher.stop()
    raise AssertionError("two viewers do not come to different replicas")


async def through_another(scene: Scene) -> None:
    """The puppeteer comes through a session replica that has not the stage."""
    owner = await scene.owner()
    for _ in range(20):
        if hasattr(scene, "puller"):
            await scene.puller.stop()
        before = await scene.stack.connected("session")
        scene.puller = Puller(scene.client, scene.session)
        async with asyncio.timeout(30):
            while not scene.puller.came:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        after = await scene.stack.connected("session")
        if after[2 - owner] > before[2 - owner] and after[owner - 1] <= before[owner - 1]:
            return
    raise AssertionError("no puppeteer comes through the other replica")
