"""Faults of uploads: a full disk, an interrupted upload, a server killed while it encodes."""

from __future__ import annotations

import asyncio
import hashlib
import secrets
import time
from urllib.parse import urlsplit

import httpx2

from bunraku.storage.motion_id import derive_motion_id
from tests.servers import make_bvh_clip
from tests.verify.result import FaultResult
from tests.verify.scenario import Scenario

DATA_FOLDER = "/var/lib/bunraku"
JOB_RETRY_TIMEOUT_S = 90.0
"""Maximum time until an abandoned job runs again, seconds."""


async def fill_disk(scenario: Scenario, rounds: int) -> FaultResult:
    """Fill the volume of the library; an upload must be rejected with 507."""
    result = FaultResult("disk full")
    async with httpx2.AsyncClient(base_url=scenario.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            clip, began = make_bvh_clip(1.0, secrets.randbelow(1 << 30)), time.monotonic()
            await scenario.stack.exec_in_replica(
                "ingest", 1, "sh", "-c", f"cat /dev/zero > {DATA_FOLDER}/filler 2>/dev/null || true"
            )
            try:
                requested = time.monotonic()
                rejected = await http.post("/v1/motions", params={"filename": "full.bvh"}, content=clip)
                took = time.monotonic() - requested
                violations = (
                    [] if rejected.status_code == 507 else [f"an upload returned {rejected.status_code}, expected 507"]
                )
                violations += await _check_unlisted(http, clip)
                violations += [f"lost: {one}" for one in await scenario.find_lost_motions()]
            finally:
                await scenario.stack.exec_in_replica("ingest", 1, "rm", f"{DATA_FOLDER}/filler")
            again = await http.post("/v1/motions", params={"filename": "full.bvh"}, content=clip)
            if again.status_code != 201:
                violations.append(f"an upload with free space returned {again.status_code}, expected 201")
            else:
                scenario.acknowledged.append(again.json()["id"])
            lost = await scenario.find_lost_motions()
            figures, found = scenario.evaluate(began)
            result.add_round(
                {"refused_s": took, "lost": float(len(lost)), "resume_s": figures["resume_s"]}, *violations, *found
            )
    return result


async def interrupt_upload(scenario: Scenario, rounds: int) -> FaultResult:
    """Interrupt an upload half-way; nothing must be left behind."""
    result, parts = FaultResult("upload cut half-way"), urlsplit(scenario.stack.url)
    async with httpx2.AsyncClient(base_url=scenario.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            clip = make_bvh_clip(4.0, secrets.randbelow(1 << 30))
            _, writer = await asyncio.open_connection(parts.hostname, parts.port)
            requested = f"POST /v1/motions?filename=cut.bvh HTTP/1.1\r\nHost: {parts.netloc}"
            head = f"{requested}\r\nContent-Length: {len(clip)}\r\n\r\n"
            writer.write(head.encode() + clip[: len(clip) // 2])
            await writer.drain()
            await asyncio.sleep(0.5)
            writer.transport.abort()
            await asyncio.sleep(1.0)
            violations = await _check_unlisted(http, clip)
            leftovers = await _find_leftovers(scenario)
            violations += [f"left behind: {leftovers}"] if leftovers else []
            result.add_round({"left": float(len(leftovers.split()))}, *violations)
    return result


async def kill_while_encoding(scenario: Scenario, rounds: int) -> FaultResult:
    """Kill ingest while it encodes; the job must finish without a second upload."""
    result = FaultResult("ingest killed while encoding")
    async with httpx2.AsyncClient(base_url=scenario.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            clip, name = make_bvh_clip(40.0, secrets.randbelow(1 << 30)), secrets.token_hex(8)
            query = {"filename": "long.bvh", "upload": name}
            sending = asyncio.create_task(http.post("/v1/motions", params=query, content=clip))
            while not sending.done():
                progress = await http.get(f"/v1/uploads/{name}")
                if progress.status_code == 200 and progress.json()["stage"] == "encoding":
                    break
                await asyncio.sleep(0.05)
            early = sending.done()
            began = time.monotonic()
            await scenario.stack.kill("ingest")
            answer = (await asyncio.gather(sending, return_exceptions=True))[0]
            violations = ["the upload was encoded before the server could be killed"] if early else []
            if isinstance(answer, httpx2.Response) and answer.is_success and not early:
                violations.append("a killed server acknowledged the upload")
            await scenario.stack.wait_until_healthy()
            violations += await _check_unlisted(http, clip) if time.monotonic() - began < 6.0 else []
            motion = derive_motion_id(hashlib.sha256(clip).digest())
            while time.monotonic() < began + JOB_RETRY_TIMEOUT_S:
                if (await http.get(f"/v1/motions/{motion}")).status_code == 200:
                    scenario.acknowledged.append(motion)
                    break
                await asyncio.sleep(0.2)
            else:
                violations.append("the job did not run again")
            took = time.monotonic() - began
            await asyncio.sleep(0.5)
            leftovers = await _find_leftovers(scenario)
            violations += [f"left behind: {leftovers}"] if leftovers else []
            violations += [f"lost: {one}" for one in await scenario.find_lost_motions()]
            result.add_round({"again_s": took}, *violations)
    return result


async def _check_unlisted(http: httpx2.AsyncClient, clip: bytes) -> list[str]:
    """Check that an unacknowledged motion is not listed."""
    motion = derive_motion_id(hashlib.sha256(clip).digest())
    status = (await http.get(f"/v1/motions/{motion}")).status_code
    listed = [one["id"] for one in (await http.get("/v1/motions", params={"limit": 200})).json()["items"]]
    return [] if status == 404 and motion not in listed else [f"an unfinished motion is listed ({status})"]


async def _find_leftovers(scenario: Scenario) -> str:
    """Return the leftovers of finished uploads."""
    found = f"ls -d /tmp/bunraku-upload-* {DATA_FOLDER}/sources/* 2>/dev/null || true"
    return (await scenario.stack.exec_in_replica("ingest", 1, "sh", "-c", found)).strip()
