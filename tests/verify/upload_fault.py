"""The faults of uploads: no room, a sender who goes, a server that dies at work."""

from __future__ import annotations

import asyncio
import hashlib
import secrets
import time
from urllib.parse import urlsplit

import httpx2

from bunraku.ingest.motion_id import derive_motion_id
from tests.servers import make_bvh_clip
from tests.verify.result import FaultResult
from tests.verify.scenario import Scenario

DATA_FOLDER = "/var/lib/bunraku"
JOB_RETRY_TIMEOUT_S = 90.0
"""Seconds for which a job that was left is waited for."""


async def fill_disk(scene: Scenario, rounds: int) -> FaultResult:
    """The library's volume is full."""
    row = FaultResult("disk full")
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            sent, began = make_bvh_clip(1.0, secrets.randbelow(1 << 30)), time.monotonic()
            await scene.stack.exec_in_replica(
                "ingest", 1, "sh", "-c", f"cat /dev/zero > {DATA_FOLDER}/filler 2>/dev/null || true"
            )
            try:
                asked = time.monotonic()
                refused = await http.post("/v1/motions", params={"filename": "full.bvh"}, content=sent)
                took = time.monotonic() - asked
                broken = [] if refused.status_code == 507 else [f"an upload was answered {refused.status_code}"]
                broken += await _check_unlisted(http, sent)
                broken += [f"lost: {one}" for one in await scene.find_lost_motions()]
            finally:
                await scene.stack.exec_in_replica("ingest", 1, "rm", f"{DATA_FOLDER}/filler")
            again = await http.post("/v1/motions", params={"filename": "full.bvh"}, content=sent)
            if again.status_code != 201:
                broken.append(f"with room again an upload was answered {again.status_code}")
            else:
                scene.acknowledged.append(again.json()["id"])
            lost = await scene.find_lost_motions()
            figures, odd = scene.evaluate(began)
            row.add_round({"refused_s": took, "lost": float(len(lost)), "resume_s": figures["resume_s"]}, *broken, *odd)
    return row


async def interrupt_upload(scene: Scenario, rounds: int) -> FaultResult:
    """A sender goes away with half of it sent."""
    row, parts = FaultResult("upload cut half-way"), urlsplit(scene.stack.url)
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            sent = make_bvh_clip(4.0, secrets.randbelow(1 << 30))
            _, writer = await asyncio.open_connection(parts.hostname, parts.port)
            asked = f"POST /v1/motions?filename=cut.bvh HTTP/1.1\r\nHost: {parts.netloc}"
            head = f"{asked}\r\nContent-Length: {len(sent)}\r\n\r\n"
            writer.write(head.encode() + sent[: len(sent) // 2])
            await writer.drain()
            await asyncio.sleep(0.5)
            writer.transport.abort()
            await asyncio.sleep(1.0)
            broken = await _check_unlisted(http, sent)
            left = await _find_leftovers(scene)
            broken += [f"left behind: {left}"] if left else []
            row.add_round({"left": float(len(left.split()))}, *broken)
    return row


async def kill_while_encoding(scene: Scenario, rounds: int) -> FaultResult:
    """Ingest is killed while it encodes: the motion is made all the same, and nobody sends it again."""
    row = FaultResult("ingest killed while encoding")
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            sent, name = make_bvh_clip(40.0, secrets.randbelow(1 << 30)), secrets.token_hex(8)
            query = {"filename": "long.bvh", "upload": name}
            sending = asyncio.create_task(http.post("/v1/motions", params=query, content=sent))
            while not sending.done():
                said = await http.get(f"/v1/uploads/{name}")
                if said.status_code == 200 and said.json()["stage"] == "encoding":
                    break
                await asyncio.sleep(0.05)
            early = sending.done()
            began = time.monotonic()
            await scene.stack.kill("ingest")
            answer = (await asyncio.gather(sending, return_exceptions=True))[0]
            broken = ["it was encoded before it could be killed"] if early else []
            if isinstance(answer, httpx2.Response) and answer.is_success and not early:
                broken.append("it was acknowledged by a server that was dead")
            await scene.stack.wait_until_healthy()
            broken += await _check_unlisted(http, sent) if time.monotonic() - began < 6.0 else []
            motion = derive_motion_id(hashlib.sha256(sent).digest())
            while time.monotonic() < began + JOB_RETRY_TIMEOUT_S:
                if (await http.get(f"/v1/motions/{motion}")).status_code == 200:
                    scene.acknowledged.append(motion)
                    break
                await asyncio.sleep(0.2)
            else:
                broken.append("the job did not run again")
            took = time.monotonic() - began
            await asyncio.sleep(0.5)
            left = await _find_leftovers(scene)
            broken += [f"left behind: {left}"] if left else []
            broken += [f"lost: {one}" for one in await scene.find_lost_motions()]
            row.add_round({"again_s": took}, *broken)
    return row


async def _check_unlisted(http: httpx2.AsyncClient, sent: bytes) -> list[str]:
    """What is wrong where something that was not acknowledged is listed."""
    motion = derive_motion_id(hashlib.sha256(sent).digest())
    status = (await http.get(f"/v1/motions/{motion}")).status_code
    listed = [one["id"] for one in (await http.get("/v1/motions", params={"limit": 200})).json()["items"]]
    return [] if status == 404 and motion not in listed else [f"it is listed half made ({status})"]


async def _find_leftovers(scene: Scenario) -> str:
    """What lies about of uploads that are over."""
    found = f"ls -d /tmp/bunraku-upload-* {DATA_FOLDER}/sources/* 2>/dev/null || true"
    return (await scene.stack.exec_in_replica("ingest", 1, "sh", "-c", found)).strip()
