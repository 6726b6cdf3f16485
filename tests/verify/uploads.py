"""The faults of uploads: no room, a sender who goes, a server that dies at work."""

from __future__ import annotations

import asyncio
import hashlib
import secrets
import time
from urllib.parse import urlsplit

import httpx2

from bunraku.ingest.uploads import motion_id
from tests.servers import clip
from tests.verify.rows import Row
from tests.verify.scene import Scene

LIBRARY = "/var/lib/bunraku"
AGAIN = 90.0
"""Seconds for which a job that was left is waited for."""


async def full(scene: Scene, rounds: int) -> Row:
    """The library's volume is full."""
    row = Row("disk full")
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            sent, began = clip(1.0, secrets.randbelow(1 << 30)), time.monotonic()
            await scene.stack.inside("ingest", 1, "sh", "-c", f"cat /dev/zero > {LIBRARY}/filler 2>/dev/null || true")
            try:
                asked = time.monotonic()
                refused = await http.post("/v1/motions", params={"filename": "full.bvh"}, content=sent)
                took = time.monotonic() - asked
                broken = [] if refused.status_code == 507 else [f"an upload was answered {refused.status_code}"]
                broken += await _listed(http, sent)
                broken += [f"lost: {one}" for one in await scene.lost()]
            finally:
                await scene.stack.inside("ingest", 1, "rm", f"{LIBRARY}/filler")
            again = await http.post("/v1/motions", params={"filename": "full.bvh"}, content=sent)
            if again.status_code != 201:
                broken.append(f"with room again an upload was answered {again.status_code}")
            else:
                scene.acknowledged.append(again.json()["id"])
            lost = await scene.lost()
            figures, odd = scene.judge(began)
            row.round({"refused_s": took, "lost": float(len(lost)), "resume_s": figures["resume_s"]}, *broken, *odd)
    return row


async def cut(scene: Scene, rounds: int) -> Row:
    """A sender goes away with half of it sent."""
    row, parts = Row("upload cut half-way"), urlsplit(scene.stack.url)
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            sent = clip(4.0, secrets.randbelow(1 << 30))
            _, writer = await asyncio.open_connection(parts.hostname, parts.port)
            asked = f"POST /v1/motions?filename=cut.bvh HTTP/1.1\r\nHost: {parts.netloc}"
            head = f"{asked}\r\nContent-Length: {len(sent)}\r\n\r\n"
            writer.write(head.encode() + sent[: len(sent) // 2])
            await writer.drain()
            await asyncio.sleep(0.5)
            writer.transport.abort()
            await asyncio.sleep(1.0)
            broken = await _listed(http, sent)
            left = await _left(scene)
            broken += [f"left behind: {left}"] if left else []
            row.round({"left": float(len(left.split()))}, *broken)
    return row


async def killed_encoding(scene: Scene, rounds: int) -> Row:
    """Ingest is killed while it encodes: the motion is made all the same, and nobody sends it again."""
    row = Row("ingest killed while encoding")
    async with httpx2.AsyncClient(base_url=scene.stack.url, timeout=60.0) as http:
        for _ in range(rounds):
            sent, name = clip(40.0, secrets.randbelow(1 << 30)), secrets.token_hex(8)
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
            await scene.stack.healthy()
            broken += await _listed(http, sent) if time.monotonic() - began < 6.0 else []
            motion = motion_id(hashlib.sha256(sent).digest())
            while time.monotonic() < began + AGAIN:
                if (await http.get(f"/v1/motions/{motion}")).status_code == 200:
                    scene.acknowledged.append(motion)
                    break
                await asyncio.sleep(0.2)
            else:
                broken.append("the job did not run again")
            took = time.monotonic() - began
            await asyncio.sleep(0.5)
            left = await _left(scene)
            broken += [f"left behind: {left}"] if left else []
            broken += [f"lost: {one}" for one in await scene.lost()]
            row.round({"again_s": took}, *broken)
    return row


async def _listed(http: httpx2.AsyncClient, sent: bytes) -> list[str]:
    """What is wrong where something that was not acknowledged is listed."""
    motion = motion_id(hashlib.sha256(sent).digest())
    status = (await http.get(f"/v1/motions/{motion}")).status_code
    listed = [one["id"] for one in (await http.get("/v1/motions", params={"limit": 200})).json()["items"]]
    return [] if status == 404 and motion not in listed else [f"it is listed half made ({status})"]


async def _left(scene: Scene) -> str:
    """What lies about of uploads that are over."""
    found = f"ls -d /tmp/bunraku-upload-* {LIBRARY}/sources/* 2>/dev/null || true"
    return (await scene.stack.inside("ingest", 1, "sh", "-c", found)).strip()
