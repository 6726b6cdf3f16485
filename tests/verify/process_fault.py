"""Faults of processes: killed, unavailable for a while, stopped in order."""

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
"""Maximum time until a write is rejected during an outage, seconds."""


async def kill_service(scenario: Scenario, target: str, folder: Path, rounds: int) -> FaultResult:
    """Kill one of `KILL_TARGETS` with `kill -9` during playback."""
    result, service = FaultResult(f"kill -9 {target}"), target.partition(":")[0]
    for _ in range(rounds):
        await scenario.upload_motion(folder)
        await scenario.record_motion()
        if service == "session":
            await connect_through_other_replica(scenario)
            owner = await scenario.find_owner_replica()
            replica = owner if "stage" in target else 3 - owner
        else:
            replica = await _busiest_replica(scenario.stack, service)
        restarts, began = await scenario.stack.restarts(service, replica), time.monotonic()
        await scenario.stack.kill(service, replica)
        # give clients time to detect the loss
        await asyncio.sleep(1.0)
        resumed = await scenario.wait_for_overlays(time.monotonic())
        figures, violations = scenario.evaluate(began)
        figures["healthy_s"] = await scenario.stack.wait_until_healthy()
        violations += [] if resumed else ["viewers receive no overlays of the controlled limb"]
        violations += (
            []
            if await scenario.stack.restarts(service, replica) == restarts + 1
            else ["the container was not restarted exactly once"]
        )
        violations += await _check_integrity(scenario, figures)
        result.add_round(figures, *violations)
    return result


async def run_outage(scenario: Scenario, service: str, folder: Path, rounds: int, seconds: float) -> FaultResult:
    """Stop NATS or PostgreSQL for a while; playback must continue and writes must be rejected quickly."""
    result = FaultResult(f"{service} gone for {seconds:g} s")
    write: Callable[[], Awaitable[tuple[int, float]]] = (
        (lambda: _timed_request(scenario, "PATCH", f"/v1/sessions/{scenario.session}", json={"loop": True}))
        if service == "nats"
        else (lambda: _timed_request(scenario, "DELETE", "/v1/motions/none"))
    )
    for _ in range(rounds):
        await scenario.upload_motion(folder)
        frames = [one.statistics.frames for one in scenario.viewers]
        dark_before = [one.statistics.dark_ms for one in scenario.viewers]
        began, violations, slowest = time.monotonic(), [], 0.0
        await scenario.stack.kill_all_replicas(service)
        outage_began = time.monotonic()
        while time.monotonic() < outage_began + seconds:
            status, took = await write()
            slowest = max(slowest, took)
            if status != 503:
                violations.append(f"a write returned {status}, expected 503")
            await asyncio.sleep(1.0)
        shown = time.monotonic() - began
        played = min(one.statistics.frames - had for one, had in zip(scenario.viewers, frames, strict=True)) / (
            20.0 * shown
        )
        dark_ms = max(one.statistics.dark_ms - had for one, had in zip(scenario.viewers, dark_before, strict=True))
        restarted = time.monotonic()
        await scenario.stack.compose("start", service)
        while (await write())[0] == 503 and time.monotonic() < restarted + 30:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        await scenario.wait_for_overlays(restarted)
        recovery_s = time.monotonic() - restarted
        await scenario.stack.wait_until_healthy()
        figures, found = scenario.evaluate(time.monotonic() - 0.5)
        figures = {"refused_s": slowest, "heal_s": recovery_s, "dark_ms": dark_ms, "off_ms": figures["off_ms"]}
        violations += found
        if slowest > MAX_REFUSAL_S:
            violations.append(f"a write was rejected after {slowest:.1f} s")
        if recovery_s > MAX_SILENCE_S:
            errors = [
                f"{when - restarted:.1f} s: {reason}" for when, reason in scenario.puppeteer.errors if when > restarted
            ]
            violations.append(f"recovery took {recovery_s:.1f} s; errors of the puppeteer: {'; '.join(errors)}")
        if dark_ms > 0 or played < 0.8:
            violations.append(f"playback stalled: {dark_ms:.0f} ms dark, {played:.2f} of the pictures shown")
        violations += await _check_integrity(scenario, figures)
        result.add_round(figures, *violations)
    return result


async def stop_stream_service(scenario: Scenario, rounds: int) -> FaultResult:
    """Stop the stream service in order; each connection must be closed with code 1012."""
    result = FaultResult("docker compose stop stream")
    for _ in range(rounds):
        dark_before = [one.statistics.dark_ms for one in scenario.viewers]
        counts = [len(one.closes) for one in scenario.viewers]
        began = time.monotonic()
        await scenario.stack.compose("stop", "stream")
        took = time.monotonic() - began
        closes = [one.closes[had:] for one, had in zip(scenario.viewers, counts, strict=True)]
        violations = [
            f"a viewer was not asked to reconnect: {found}" for found in closes if not found or found[0][1] != 1012
        ]
        closed_s = max((found[0][0] - began for found in closes if found), default=took)
        await scenario.stack.compose("start", "stream")
        restarted = time.monotonic()
        if not await scenario.wait_for_overlays(restarted):
            violations.append("viewers did not reconnect")
        dark_ms = max(one.statistics.dark_ms - had for one, had in zip(scenario.viewers, dark_before, strict=True))
        figures = {"told_s": closed_s, "stopped_s": took, "back_s": time.monotonic() - restarted, "dark_ms": dark_ms}
        await scenario.stack.wait_until_healthy()
        result.add_round(figures, *violations, *scenario.evaluate(time.monotonic() - 0.5)[1])
    return result


async def stop_one_stream_replica(scenario: Scenario, rounds: int) -> FaultResult:
    """Stop one replica of the stream service; its viewers must continue at the other."""
    result = FaultResult("one stream replica stops")
    for _ in range(rounds):
        dark_before = [one.statistics.dark_ms for one in scenario.viewers]
        replica = await _busiest_replica(scenario.stack, "stream")
        began = time.monotonic()
        await scenario.stack.stop_replica("stream", replica)
        resumed = await scenario.wait_for_overlays(time.monotonic())
        figures, violations = scenario.evaluate(began)
        dark_ms = max(one.statistics.dark_ms - had for one, had in zip(scenario.viewers, dark_before, strict=True))
        violations += [] if resumed else ["viewers did not reconnect"]
        violations += [f"{dark_ms:.0f} ms were dark"] if dark_ms else []
        figures["dark_ms"] = dark_ms
        await scenario.stack.compose("start", "stream")
        await scenario.stack.wait_until_healthy()
        result.add_round(figures, *violations)
    return result


async def _busiest_replica(stack: Stack, service: str) -> int:
    """Return the number of the replica with the most connections."""
    if service != "stream":
        return 1
    connections = await stack.count_connections(service)
    return connections.index(max(connections)) + 1


async def _check_integrity(scenario: Scenario, figures: dict[str, float]) -> list[str]:
    """Check that no acknowledged motion is lost and not more inputs were applied than sent."""
    lost, applied = await scenario.find_lost_motions(), await scenario.count_applied_inputs()
    sent = scenario.puppeteer.sent_inputs
    figures |= {"lost": float(len(lost)), "applied": float(applied)}
    violations = [f"lost: {one}" for one in lost]
    if not 0 < applied <= sent:
        violations.append(f"{applied} inputs were applied of {sent} that were sent")
    return violations


async def _timed_request(scenario: Scenario, method: str, path: str, **options: object) -> tuple[int, float]:
    """Send a request; return the status of the response (0 if there was none) and the time it took."""
    began = time.monotonic()
    async with httpx2.AsyncClient(base_url=scenario.stack.url, timeout=10.0) as http:
        try:
            status = (await http.request(method, path, **options)).status_code  # type: ignore[arg-type]
        except httpx2.TransportError:
            status = 0
    return status, time.monotonic() - began
