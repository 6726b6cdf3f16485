"""Floods of small valid requests on many connections: row 3."""

from __future__ import annotations

import asyncio
import time

from tests.attack.raw_socket import open_socket, request
from tests.attack.registry import Report, Target, attack

CALM = "others' overlay gap p99 <= 1.3x calm"
CONNECTIONS = 50


async def flood_requests(target: Target, report: Report, *requests: bytes) -> None:
    """Send pipelined requests on many connections of ten addresses, and read all responses."""
    data = b"".join(requests) * 20

    async def run(number: int) -> None:
        until = time.monotonic() + target.seconds
        while time.monotonic() < until:
            async with open_socket(target, address=1 + number % 10) as opened:
                sending = asyncio.create_task(opened.send(data * 20, target.seconds))
                while time.monotonic() < until and not opened.is_closed:
                    report.count("responses", (await opened.receive(0.5)).count(b"HTTP/1.1 "))
                sending.cancel()
                await asyncio.gather(sending, return_exceptions=True)

    await asyncio.gather(*(run(number) for number in range(CONNECTIONS)))


@attack(3, CALM)
async def requests_without_a_token_on_fifty_connections(target: Target, report: Report) -> None:
    """Request public pages, unknown paths and rejected resources again and again."""
    paths = ("/v1/health", "/", "/v1/nothing", "/nothing.js", f"/v1/motions/{target.motion}", "/v1/sessions")
    await flood_requests(target, report, *(request(target, "GET", path) for path in paths))


@attack(3, CALM)
async def requests_of_a_viewer_on_fifty_connections(target: Target, report: Report) -> None:
    """Request resources that a viewer may see again and again."""
    motion, token = f"/v1/motions/{target.motion}", target.tokens["view"]
    paths = ("/v1/sessions", "/v1/motions", motion, f"{motion}/blocks/0/0", f"{motion}/description", "/v1/openapi.json")
    await flood_requests(target, report, *(request(target, "GET", path, token=token) for path in paths))
