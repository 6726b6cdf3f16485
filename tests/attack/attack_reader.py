"""Clients that do not read what they request: row 10."""

from __future__ import annotations

import asyncio
import json
import re
import time

from tests.attack.attack_body import JSON, PROPORTIONS
from tests.attack.attack_socket import MAX_WRITE_DEADLINE_S
from tests.attack.raw_socket import RawSocket, fetch, handshake, request
from tests.attack.registry import Report, Target, attack

READERS = 8
"""Connections for each resource."""
PONG = b"\x8a\x80\0\0\0\0"
CRITERION = "RSS bounded; the connection is closed after a write deadline"


async def find_page_files(target: Target) -> list[str]:
    """Return the paths of the scripts of the page."""
    page = await fetch(target, "GET", "/")
    text = page.body.decode(errors="replace") if page else ""
    return re.findall(r'(?:src|href)="(/[^"]+\.(?:js|css))"', text)


async def _large_requests(target: Target) -> dict[str, bytes]:
    """Return requests with large responses, by name. A batch of small ones is sent as pipelined requests."""
    token = target.tokens["view"]
    body = json.dumps({"proportions": PROPORTIONS, "targets": [[0.4, 0.1, 0.4]] * 100_000}).encode()
    small = json.dumps({"proportions": PROPORTIONS, "targets": [[0.4, 0.1, 0.4]] * 1_000}).encode()
    requests = {
        "solve of 100,000": request(target, "POST", "/v1/solve", JSON, token=token, body=body),
        "solve of 1,000": request(target, "POST", "/v1/solve", JSON, token=token, body=small) * 40,
        "openapi.json": request(target, "GET", "/v1/openapi.json") * 100,
        "docs": request(target, "GET", "/v1/docs") * 1_000,
        "motions": request(target, "GET", "/v1/motions?limit=200", token=token) * 1_000,
        "description": request(target, "GET", f"/v1/motions/{target.motion}/description", token=token) * 1_000,
    }
    for path in (await find_page_files(target))[:2]:
        requests[path] = request(target, "GET", path) * 40
    return requests


async def _open_readers(target: Target, requests: dict[str, bytes]) -> list[tuple[str, RawSocket]]:
    opened = []
    for name, data in requests.items():
        for number in range(READERS):
            one = await RawSocket.connect(target, receive_buffer_bytes=4_096, address=1 + number)
            await one.send(data, 1.0)
            opened.append((name, one))
    return opened


@attack(10, CRITERION, seconds=MAX_WRITE_DEADLINE_S, quick=True)
async def large_responses_that_are_not_read(target: Target, report: Report) -> None:
    """Request every large response on eight connections each and read nothing."""
    opened = await _open_readers(target, await _large_requests(target))
    report.count("connections", len(opened))
    until = time.monotonic() + target.seconds
    left = list(opened)
    while left and time.monotonic() < until:
        await asyncio.sleep(0.5)
        left = [(name, one) for name, one in left if not await one.is_aborted(b"\r\n")]
    report.count("aborted", len(opened) - len(left))
    if target.seconds >= MAX_WRITE_DEADLINE_S:
        names = sorted({name for name, _ in left})
        report.require(not left, f"{len(left)} connections are open after {target.seconds:g} s: {', '.join(names)}")
    for _, one in opened:
        one.close()


@attack(10, CRITERION, seconds=MAX_WRITE_DEADLINE_S)
async def large_responses_that_are_read_slowly(target: Target, report: Report) -> None:
    """Request large responses on eight connections each and read 50 bytes per second."""
    opened = await _open_readers(target, await _large_requests(target))
    until = time.monotonic() + target.seconds
    while time.monotonic() < until:
        await asyncio.gather(*(one.receive(0.1, 50) for _, one in opened if not one.is_closed))
        await asyncio.sleep(1.0)
    report.count("connections", len(opened))
    report.count("closed", sum(one.is_closed for _, one in opened))
    for _, one in opened:
        one.close()


@attack(10, CRITERION, seconds=MAX_WRITE_DEADLINE_S)
async def streams_that_are_not_read(target: Target, report: Report) -> None:
    """Open a hundred streams and read nothing, not even the response to the handshake."""
    opened = []
    for number in range(100):
        one = await RawSocket.connect(target, receive_buffer_bytes=4_096, address=1 + number % 4)
        path = target.stream if number & 1 else target.motion_stream
        await one.send(handshake(target, path, target.tokens["view"]))
        opened.append(one)
    await asyncio.sleep(target.seconds - 1.0)
    # a Pong before the end would count as a sign of life
    left = sum([not await one.is_aborted(PONG) for one in opened])
    report.count("still open", left)
    if target.seconds >= MAX_WRITE_DEADLINE_S:
        report.require(not left, f"{left} streams are open after {target.seconds:g} s")
    report.count("connections", len(opened))
    for one in opened:
        one.close()


@attack(10, CRITERION, seconds=MAX_WRITE_DEADLINE_S)
async def rejected_handshakes_that_are_not_read(target: Target, report: Report) -> None:
    """Open sockets without a token and with bad requests, and read nothing."""
    bad = b"BAD REQUEST\r\n\r\n"
    opened = []
    for number in range(100):
        one = await RawSocket.connect(target, receive_buffer_bytes=4_096, address=1 + number % 8)
        await one.send(bad if number & 1 else handshake(target, target.stream))
        opened.append(one)
    until = time.monotonic() + target.seconds
    left = opened
    while left and time.monotonic() < until:
        await asyncio.sleep(0.5)
        left = [one for one in left if not await one.is_aborted(PONG)]
    report.count("aborted", len(opened) - len(left))
    if target.seconds >= MAX_WRITE_DEADLINE_S:
        report.require(not left, f"{len(left)} rejected connections are open after {target.seconds:g} s")
    for one in opened:
        one.close()
