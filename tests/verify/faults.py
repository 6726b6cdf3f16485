"""The faults of processes: killed, gone for a while, stopped in order."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import httpx2

from tests.verify.rows import Row
from tests.verify.scene import RESUMED, Scene, through_another
from tests.verify.stack import Stack

KILLED = (
    "gateway",
    "ingest",
    "stream",
    "ik",
    "session: the stage's",
    "session: the puppeteer's",
    "page",
    "nats",
    "postgres",
)
ANSWERED = 2.0
"""Seconds within which a write is refused."""


async def killed(scene: Scene, which: str, folder: Path, rounds: int) -> Row:
    """`kill -9` of one of `KILLED`, mid-stream."""
    row, service = Row(f"kill -9 {which}"), which.partition(":")[0]
    for _ in range(rounds):
        await scene.upload(folder)
        await scene.keep()
        if service == "session":
            await through_another(scene)
            owner = await scene.owner()
            replica = owner if "stage" in which else 3 - owner
        else:
            replica = await _busiest(scene.stack, service)
        restarts, began = await scene.stack.restarts(service, replica), time.monotonic()
        await scene.stack.kill(service, replica)
        # who has not noticed yet has nothing to come back from
        await asyncio.sleep(1.0)
        flows = await scene.flows(time.monotonic())
        figures, broken = scene.judge(began)
        figures["healthy_s"] = await scene.stack.healthy()
        broken += [] if flows else ["the pulled limb is not seen again"]
        broken += (
            [] if await scene.stack.restarts(service, replica) == restarts + 1 else ["it was not started anew once"]
        )
        broken += await _whole(scene, figures)
        row.round(figures, *broken)
    return row


async def gone(scene: Scene, service: str, folder: Path, rounds: int, seconds: float) -> Row:
    """NATS or PostgreSQL is not there for a while."""
    row = Row(f"{service} gone for {seconds:g} s")
    write: Callable[[], Awaitable[tuple[int, float]]] = (
        (lambda: _asked(scene, "PATCH", f"/v1/sessions/{scene.session}", json={"loop": True}))
        if service == "nats"
        else (lambda: _asked(scene, "DELETE", "/v1/motions/none"))
    )
    for _ in range(rounds):
        await scene.upload(folder)
        frames = [one.figures.frames for one in scene.watchers]
        dark = [one.figures.dark_ms for one in scene.watchers]
        began, broken, slowest = time.monotonic(), [], 0.0
        await scene.stack.take_away(service)
        left = time.monotonic()
        while time.monotonic() < left + seconds:
            status, took = await write()
            slowest = max(slowest, took)
            if status != 503:
                broken.append(f"a write was answered {status}")
            await asyncio.sleep(1.0)
        shown = time.monotonic() - began
        played = min(one.figures.frames - had for one, had in zip(scene.watchers, frames, strict=True)) / (20.0 * shown)
        black = max(one.figures.dark_ms - had for one, had in zip(scene.watchers, dark, strict=True))
        back = time.monotonic()
        await scene.stack.compose("start", service)
        while (await write())[0] == 503 and time.monotonic() < back + 30:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        await scene.flows(back)
        healed = time.monotonic() - back
        await scene.stack.healthy()
        figures, odd = scene.judge(time.monotonic() - 0.5)
        figures = {"refused_s": slowest, "heal_s": healed, "dark_ms": black, "off_ms": figures["off_ms"]}
        broken += odd
        if slowest > ANSWERED:
            broken.append(f"a write was refused after {slowest:.1f} s")
        if healed > RESUMED:
            told = [f"{when - back:.1f} s: {why}" for when, why in scene.puller.told if when > back]
            broken.append(f"it took {healed:.1f} s to heal; the puppeteer was told: {'; '.join(told)}")
        if black > 0 or played < 0.8:
            broken.append(f"the dance stood: {black:.0f} ms dark, {played:.2f} of the pictures")
        broken += await _whole(scene, figures)
        row.round(figures, *broken)
    return row


async def stopped(scene: Scene, rounds: int) -> Row:
    """`docker compose stop stream`: each is told to come again."""
    row = Row("docker compose stop stream")
    for _ in range(rounds):
        dark = [one.figures.dark_ms for one in scene.watchers]
        counts = [len(one.closes) for one in scene.watchers]
        began = time.monotonic()
        await scene.stack.compose("stop", "stream")
        took = time.monotonic() - began
        closes = [one.closes[had:] for one, had in zip(scene.watchers, counts, strict=True)]
        broken = [
            f"a viewer was not told to come again: {found}" for found in closes if not found or found[0][1] != 1012
        ]
        told = max((found[0][0] - began for found in closes if found), default=took)
        await scene.stack.compose("start", "stream")
        back = time.monotonic()
        if not await scene.flows(back):
            broken.append("viewers did not come back")
        black = max(one.figures.dark_ms - had for one, had in zip(scene.watchers, dark, strict=True))
        figures = {"told_s": told, "stopped_s": took, "back_s": time.monotonic() - back, "dark_ms": black}
        await scene.stack.healthy()
        row.round(figures, *broken, *scene.judge(time.monotonic() - 0.5)[1])
    return row


async def moved(scene: Scene, rounds: int) -> Row:
    """One replica of the stream service stops: its viewers go on at the other."""
    row = Row("one stream replica stops")
    for _ in range(rounds):
        dark = [one.figures.dark_ms for one in scene.watchers]
        replica = await _busiest(scene.stack, "stream")
        began = time.monotonic()
        await scene.stack.stop_one("stream", replica)
        flows = await scene.flows(time.monotonic())
        figures, broken = scene.judge(began)
        black = max(one.figures.dark_ms - had for one, had in zip(scene.watchers, dark, strict=True))
        broken += [] if flows else ["viewers did not come back"]
        broken += [f"{black:.0f} ms were dark"] if black else []
        figures["dark_ms"] = black
        await scene.stack.compose("start", "stream")
        await scene.stack.healthy()
        row.round(figures, *broken)
    return row


async def _busiest(stack: Stack, service: str) -> int:
    """The number of the replica that has most to do."""
    if service != "stream":
        return 1
    connections = await stack.connected(service)
    return connections.index(max(connections)) + 1


async def _whole(scene: Scene, figures: dict[str, float]) -> list[str]:
    """What of the acknowledged is lost, and whether an input was applied twice."""
    lost, inputs = await scene.lost(), await scene.inputs()
    figures |= {"lost": float(len(lost)), "twice": float(inputs["twice"])}
    broken = [f"lost: {one}" for one in lost]
    if inputs["twice"]:
        broken.append(f"{inputs['twice']} inputs were applied twice")
    if not inputs["applied"]:
        broken.append("no input was applied")
    return broken


async def _asked(scene: Scene, method: str, path: str, **options: object) -> tuple[int, float]:
    """The status of an answer, and how long it took."""
    began = time.monotonic()
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=10.0) as http:
        try:
            status = (await http.request(method, path, **options)).status_code  # type: ignore[arg-type]
        except httpx2.TransportError:
            status = 0
    return status, time.monotonic() - began
