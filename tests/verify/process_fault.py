"""The faults of processes: killed, gone for a while, stopped in order."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import httpx2

from tests.verify.result import FaultResult
from tests.verify.scenario import MAX_SILENCE_S, Scenario, connect_through_other_replica
from tests.verify.stack import Stack

KILL_TARGETS = (
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
MAX_REFUSAL_S = 2.0
"""Seconds within which a write is refused."""


async def kill_service(scene: Scenario, target: str, folder: Path, rounds: int) -> FaultResult:
    """`kill -9` of one of `KILLED`, mid-stream."""
    row, service = FaultResult(f"kill -9 {target}"), target.partition(":")[0]
    for _ in range(rounds):
        await scene.upload_motion(folder)
        await scene.record_motion()
        if service == "session":
            await connect_through_other_replica(scene)
            owner = await scene.find_owner_replica()
            replica = owner if "stage" in target else 3 - owner
        else:
            replica = await _busiest_replica(scene.stack, service)
        restarts, began = await scene.stack.restarts(service, replica), time.monotonic()
        await scene.stack.kill(service, replica)
        # who has not noticed yet has nothing to come back from
        await asyncio.sleep(1.0)
        flows = await scene.wait_for_overlays(time.monotonic())
        figures, broken = scene.evaluate(began)
        figures["healthy_s"] = await scene.stack.wait_until_healthy()
        broken += [] if flows else ["the pulled limb is not seen again"]
        broken += (
            [] if await scene.stack.restarts(service, replica) == restarts + 1 else ["it was not started anew once"]
        )
        broken += await _check_integrity(scene, figures)
        row.add_round(figures, *broken)
    return row


async def run_outage(scene: Scenario, service: str, folder: Path, rounds: int, seconds: float) -> FaultResult:
    """NATS or PostgreSQL is not there for a while."""
    row = FaultResult(f"{service} gone for {seconds:g} s")
    write: Callable[[], Awaitable[tuple[int, float]]] = (
        (lambda: _timed_request(scene, "PATCH", f"/v1/sessions/{scene.session}", json={"loop": True}))
        if service == "nats"
        else (lambda: _timed_request(scene, "DELETE", "/v1/motions/none"))
    )
    for _ in range(rounds):
        await scene.upload_motion(folder)
        frames = [one.statistics.frames for one in scene.viewers]
        dark = [one.statistics.dark_ms for one in scene.viewers]
        began, broken, slowest = time.monotonic(), [], 0.0
        await scene.stack.kill_all_replicas(service)
        left = time.monotonic()
        while time.monotonic() < left + seconds:
            status, took = await write()
            slowest = max(slowest, took)
            if status != 503:
                broken.append(f"a write was answered {status}")
            await asyncio.sleep(1.0)
        shown = time.monotonic() - began
        played = min(one.statistics.frames - had for one, had in zip(scene.viewers, frames, strict=True)) / (
            20.0 * shown
        )
        black = max(one.statistics.dark_ms - had for one, had in zip(scene.viewers, dark, strict=True))
        back = time.monotonic()
        await scene.stack.compose("start", service)
        while (await write())[0] == 503 and time.monotonic() < back + 30:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        await scene.wait_for_overlays(back)
        healed = time.monotonic() - back
        await scene.stack.wait_until_healthy()
        figures, odd = scene.evaluate(time.monotonic() - 0.5)
        figures = {"refused_s": slowest, "heal_s": healed, "dark_ms": black, "off_ms": figures["off_ms"]}
        broken += odd
        if slowest > MAX_REFUSAL_S:
            broken.append(f"a write was refused after {slowest:.1f} s")
        if healed > MAX_SILENCE_S:
            told = [f"{when - back:.1f} s: {why}" for when, why in scene.puppeteer.errors if when > back]
            broken.append(f"it took {healed:.1f} s to heal; the puppeteer was told: {'; '.join(told)}")
        if black > 0 or played < 0.8:
            broken.append(f"the dance stood: {black:.0f} ms dark, {played:.2f} of the pictures")
        broken += await _check_integrity(scene, figures)
        row.add_round(figures, *broken)
    return row


async def stop_stream_service(scene: Scenario, rounds: int) -> FaultResult:
    """`docker compose stop stream`: each is told to come again."""
    row = FaultResult("docker compose stop stream")
    for _ in range(rounds):
        dark = [one.statistics.dark_ms for one in scene.viewers]
        counts = [len(one.closes) for one in scene.viewers]
        began = time.monotonic()
        await scene.stack.compose("stop", "stream")
        took = time.monotonic() - began
        closes = [one.closes[had:] for one, had in zip(scene.viewers, counts, strict=True)]
        broken = [
            f"a viewer was not told to come again: {found}" for found in closes if not found or found[0][1] != 1012
        ]
        told = max((found[0][0] - began for found in closes if found), default=took)
        await scene.stack.compose("start", "stream")
        back = time.monotonic()
        if not await scene.wait_for_overlays(back):
            broken.append("viewers did not come back")
        black = max(one.statistics.dark_ms - had for one, had in zip(scene.viewers, dark, strict=True))
        figures = {"told_s": told, "stopped_s": took, "back_s": time.monotonic() - back, "dark_ms": black}
        await scene.stack.wait_until_healthy()
        row.add_round(figures, *broken, *scene.evaluate(time.monotonic() - 0.5)[1])
    return row


async def stop_one_stream_replica(scene: Scenario, rounds: int) -> FaultResult:
    """One replica of the stream service stops: its viewers go on at the other."""
    row = FaultResult("one stream replica stops")
    for _ in range(rounds):
        dark = [one.statistics.dark_ms for one in scene.viewers]
        replica = await _busiest_replica(scene.stack, "stream")
        began = time.monotonic()
        await scene.stack.stop_replica("stream", replica)
        flows = await scene.wait_for_overlays(time.monotonic())
        figures, broken = scene.evaluate(began)
        black = max(one.statistics.dark_ms - had for one, had in zip(scene.viewers, dark, strict=True))
        broken += [] if flows else ["viewers did not come back"]
        broken += [f"{black:.0f} ms were dark"] if black else []
        figures["dark_ms"] = black
        await scene.stack.compose("start", "stream")
        await scene.stack.wait_until_healthy()
        row.add_round(figures, *broken)
    return row


async def _busiest_replica(stack: Stack, service: str) -> int:
    """The number of the replica that has most to do."""
    if service != "stream":
        return 1
    connections = await stack.count_connections(service)
    return connections.index(max(connections)) + 1


async def _check_integrity(scene: Scenario, figures: dict[str, float]) -> list[str]:
    """What of the acknowledged is lost, and whether an input was applied twice."""
    lost, inputs = await scene.find_lost_motions(), await scene.count_inputs()
    figures |= {"lost": float(len(lost)), "twice": float(inputs["twice"])}
    broken = [f"lost: {one}" for one in lost]
    if inputs["twice"]:
        broken.append(f"{inputs['twice']} inputs were applied twice")
    if not inputs["applied"]:
        broken.append("no input was applied")
    return broken


async def _timed_request(scene: Scenario, method: str, path: str, **options: object) -> tuple[int, float]:
    """The status of an answer, and how long it took."""
    began = time.monotonic()
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=10.0) as http:
        try:
            status = (await http.request(method, path, **options)).status_code  # type: ignore[arg-type]
        except httpx2.TransportError:
            status = 0
    return status, time.monotonic() - began
