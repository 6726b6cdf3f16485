"""Uploads that stop, crawl or lie: row 7."""

from __future__ import annotations

import asyncio
import secrets
import time

from tests.attack.raw_socket import OPEN, RawSocket, fetch, fetch_json, open_socket, request
from tests.attack.registry import Report, Target, attack
from tests.servers import make_bvh_clip

PROGRESS_WINDOW_S = 40.0
"""Time within which an upload without progress is ended, with a margin."""
OTHERS = "others' uploads go on"


def _head(target: Target, *lines: str, path: str = "/v1/motions?filename=a.bvh") -> bytes:
    return request(target, "POST", path, *lines, token=target.tokens["ingest"])


async def _open_uploads(target: Target, count: int, head: bytes, body: bytes) -> list[RawSocket]:
    opened = []
    for number in range(count):
        one = await RawSocket.connect(target, address=1 + number % 4)
        await one.send(head + body)
        opened.append(one)
    return opened


async def _wait_until_ended(target: Target, report: Report, opened: list[RawSocket], what: str) -> None:
    """Wait for the server's reaction to unfinished uploads, and require that each is ended in a full run."""
    reactions = await asyncio.gather(*(one.describe_reaction(target.seconds) for one in opened))
    for reaction in reactions:
        report.count(reaction)
    if target.seconds >= PROGRESS_WINDOW_S:
        report.require(OPEN not in reactions, f"{reactions.count(OPEN)} {what} are held for {target.seconds:g} s")
    for one in opened:
        one.close()


@attack(
    7, f"minimum progress over 30 s; slots per subject; {OTHERS}", seconds=PROGRESS_WINDOW_S, probe="upload", quick=True
)
async def uploads_that_stop(target: Target, report: Report) -> None:
    """Begin twenty uploads of 60 MB, send 400 kB each, and stop."""
    opened = await _open_uploads(target, 20, _head(target, "Content-Length: 60000000"), b"a" * 400_000)
    await asyncio.sleep(0.2)
    await report.reach_peak()
    await _wait_until_ended(target, report, opened, "uploads")


@attack(7, f"minimum progress over 30 s; {OTHERS}", seconds=PROGRESS_WINDOW_S, probe="upload")
async def uploads_that_crawl(target: Target, report: Report) -> None:
    """Begin twenty uploads and send one byte per second, as a body with a length and in chunks."""
    chunked = await _open_uploads(target, 10, _head(target, "Transfer-Encoding: chunked"), b"")
    sized = await _open_uploads(target, 10, _head(target, "Content-Length: 60000000"), b"")
    await report.reach_peak()
    until = time.monotonic() + target.seconds
    while time.monotonic() < until:
        await asyncio.gather(*(one.send(b"1\r\na\r\n") for one in chunked), *(one.send(b"a") for one in sized))
        await asyncio.sleep(1.0)
    reactions = [await one.describe_reaction(0.1) for one in chunked + sized]
    left = reactions.count(OPEN)
    report.count(OPEN, left)
    if target.seconds >= PROGRESS_WINDOW_S:
        report.require(not left, f"{left} uploads of one byte per second are held for {target.seconds:g} s")
    for one in chunked + sized:
        one.close()


@attack(7, f"minimum progress over 30 s; {OTHERS}", seconds=PROGRESS_WINDOW_S, probe="upload")
async def uploads_without_their_last_byte(target: Target, report: Report) -> None:
    """Send twenty whole motions, but neither the last byte nor the last chunk."""
    clip = make_bvh_clip(1.0, 77)
    opened = await _open_uploads(target, 10, _head(target, f"Content-Length: {len(clip) + 1}"), clip)
    chunk = f"{len(clip):x}\r\n".encode() + clip + b"\r\n"
    opened += await _open_uploads(target, 10, _head(target, "Transfer-Encoding: chunked"), chunk)
    await report.reach_peak()
    await _wait_until_ended(target, report, opened, "unfinished uploads")


@attack(7, OTHERS, probe="upload")
async def uploads_that_are_reset(target: Target, report: Report) -> None:
    """Begin uploads on many connections and reset them in the middle."""
    until = time.monotonic() + target.seconds
    head = _head(target, "Content-Length: 60000000")

    async def run(address: int) -> None:
        while time.monotonic() < until:
            async with open_socket(target, address=address) as opened:
                await opened.send(head + b"a" * 100_000)
                report.count("reset")
                opened.reset()
            await asyncio.sleep(0.005)

    running = [asyncio.create_task(run(address)) for address in range(1, 9)]
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await asyncio.gather(*running)


@attack(7, OTHERS, probe="upload", max_rss_growth_mb=80.0)
async def many_small_uploads(target: Target, report: Report) -> None:
    """Upload valid small motions as fast as possible on eight connections."""
    until = time.monotonic() + target.seconds
    path = "/v1/motions?filename=a.bvh"

    async def run(address: int) -> None:
        while time.monotonic() < until:
            clip = make_bvh_clip(0.5, secrets.randbelow(1 << 30))
            response = await fetch(
                target, "POST", path, token=target.tokens["ingest"], body=clip, address=address, timeout_s=30.0
            )
            report.count(str(response.status if response else "no response"))
            if response is None or response.status != 201:
                await asyncio.sleep(0.05)
                continue
            await fetch(target, "DELETE", f"/v1/motions/{response.json()['id']}", token=target.tokens["ingest"])

    running = [asyncio.create_task(run(address)) for address in range(1, 9)]
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await asyncio.gather(*running)


@attack(7, f"4xx; {OTHERS}", probe="upload")
async def files_that_are_no_motions(target: Target, report: Report) -> None:
    """Upload files that are damaged, nested or endless, with hostile names."""
    clip = make_bvh_clip(1.0, 5)
    files = {
        "empty": b"",
        "zeros": bytes(200_000),
        "nested": b"HIERARCHY\nROOT a\n{\n" + b"JOINT b\n{\n" * 20_000,
        "digits": clip.replace(b"Frames: ", b"Frames: 9999999999999", 1),
        "huge number": clip[:-40] + b"9" * 100_000 + b"\n",
        "NaN": clip[:-40] + b" nan inf -inf\n",
        "one line": clip.replace(b"\n", b" "),
        "cut": clip[: len(clip) // 2],
    }
    names = ("a.bvh", "../../etc/passwd", "%00%1b%5d0;x%07.bvh", "a" * 255, "a.mp4", "%F0%9F%91%BE.bvh")

    async def run(number: int, name: str, data: bytes) -> None:
        path = f"/v1/motions?filename={names[number % len(names)]}"
        response = await fetch(target, "POST", path, token=target.tokens["ingest"], body=data, timeout_s=30.0)
        status = response.status if response else None
        report.count(str(status))
        report.require(status is not None and (status < 500 or status in (503, 507)), f"{name}: {status}")

    running = [asyncio.create_task(run(number, *one)) for number, one in enumerate(files.items())]
    await report.reach_peak()
    await asyncio.gather(*running)


@attack(7, OTHERS, probe="upload", max_rss_growth_mb=80.0)
async def recordings_of_the_session(target: Target, report: Report) -> None:
    """Record the longest time of the session again and again on eight connections."""
    until = time.monotonic() + target.seconds
    path, created = f"/v1/sessions/{target.session}/recordings", []

    async def run(address: int) -> None:
        while time.monotonic() < until:
            response = await fetch_json(
                target, "POST", path, {"seconds": 600}, token=target.tokens["ingest"], address=address, timeout_s=30.0
            )
            report.count(str(response.status if response else "no response"))
            if response is not None and response.status == 201:
                created.append(response.json()["id"])
            else:
                await asyncio.sleep(0.05)

    running = [asyncio.create_task(run(address)) for address in range(1, 9)]
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await asyncio.gather(*running)
    for one in created:
        await fetch(target, "DELETE", f"/v1/motions/{one}", token=target.tokens["ingest"])


@attack(7, "the progress of another subject's upload is not shown and not blocked")
async def upload_names_of_others(target: Target, report: Report) -> None:
    """Hold uploads under many names, and ask for the progress of names of others."""
    opened = []
    for number in range(4):
        one = await RawSocket.connect(target)
        await one.send(_head(target, "Content-Length: 1000000", path=f"/v1/motions?filename=a&upload=name{number:05}"))
        opened.append(one)
    await asyncio.sleep(0.2)
    other = target.tokens["other ingest"]
    for number in range(4):
        response = await fetch(target, "GET", f"/v1/uploads/name{number:05}", token=other)
        report.count(f"progress {response.status if response else None}")
        report.require(response is None or response.status == 404, "the progress of another subject's upload is shown")
    clip = make_bvh_clip(0.5, secrets.randbelow(1 << 30))
    response = await fetch(target, "POST", "/v1/motions?filename=a&upload=name00000", token=other, body=clip)
    report.count(f"same name {response.status if response else None}")
    report.require(
        response is not None and response.status in (200, 201),
        "an upload with the name of another subject's is refused",
    )
    for one in opened:
        one.close()
