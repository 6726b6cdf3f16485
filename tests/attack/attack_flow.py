"""Many connections that wait for something, each within its own limits: rows 5 and 10."""

from __future__ import annotations

import asyncio
import time

from tests.attack.attack_body import JSON
from tests.attack.attack_reader import find_page_files
from tests.attack.raw_socket import RawSocket, request
from tests.attack.registry import Report, Target, attack

CONNECTIONS = 1_500
ADDRESSES = 40
BOUNDED = "RSS +50 MB at most; others are served"


async def _open_many(
    target: Target, report: Report, requests: list[bytes], receive_buffer_bytes: int | None
) -> list[RawSocket]:
    """Open connections from many addresses and send one of the requests on each."""
    opened: list[RawSocket] = []

    async def run(number: int) -> None:
        try:
            one = await RawSocket.connect(
                target, receive_buffer_bytes=receive_buffer_bytes, address=1 + number % ADDRESSES
            )
        except OSError:
            report.count("not connected")
            return
        opened.append(one)
        await one.send(requests[number % len(requests)], 1.0)

    for begin in range(0, CONNECTIONS, 50):
        await asyncio.gather(*(run(number) for number in range(begin, begin + 50)))
    report.count("connections", len(opened))
    return opened


async def _hold(report: Report, opened: list[RawSocket], until: float) -> None:
    """Hold connections until a time, with the use of the server by another subject in between."""
    await asyncio.sleep(max((until - time.monotonic()) / 2, 0.0))
    await report.reach_peak()
    await asyncio.sleep(max(until - time.monotonic(), 0.0))
    for one in opened:
        one.close()


@attack(5, BOUNDED, probe="solve", seconds=6.0)
async def bodies_that_never_come(target: Target, report: Report) -> None:
    """Announce a small body on 1,500 connections, with and without `Expect: 100-continue`, and send nothing of it."""
    until = time.monotonic() + target.seconds
    token = target.tokens["view"]
    requests = [
        request(target, "POST", "/v1/solve", JSON, "Content-Length: 1000", token=token),
        request(target, "POST", "/v1/solve", JSON, "Content-Length: 1000000", "Expect: 100-continue", token=token),
        request(target, "POST", "/v1/solve", JSON, "Transfer-Encoding: chunked", token=token) + b"1\r\n{\r\n",
        request(target, "POST", "/v1/sessions", JSON, "Content-Length: 1000", token=target.tokens["control"]),
    ]
    await _hold(report, await _open_many(target, report, requests, None), until)


@attack(10, BOUNDED, probe="solve", seconds=6.0)
async def page_files_that_are_not_read(target: Target, report: Report) -> None:
    """Request the largest files of the page on 1,500 connections without a token, and read nothing."""
    until = time.monotonic() + target.seconds
    requests = [
        request(target, "GET", path, *lines)
        for path in (await find_page_files(target))[:2]
        for lines in ((), ("Accept-Encoding: gzip",))
    ]
    await _hold(report, await _open_many(target, report, requests, 4_096), until)


@attack(10, BOUNDED, probe="solve", seconds=6.0)
async def page_files_that_are_read_in_part(target: Target, report: Report) -> None:
    """Request files of the page with many ranges and compression, read the start of each, and begin again."""
    path = (await find_page_files(target))[0]
    ranges = "Range: bytes=" + ",".join(f"{number * 3}-{number * 3 + 1}" for number in range(100))
    data = request(target, "GET", path, ranges) + request(target, "GET", path, "Accept-Encoding: gzip")
    until = time.monotonic() + target.seconds

    async def run(address: int) -> None:
        while time.monotonic() < until:
            one = await RawSocket.connect(target, receive_buffer_bytes=4_096, address=address)
            await one.send(data, 1.0)
            await one.receive(0.5, 1_000)
            report.count("closed" if one.is_closed else "read")
            one.reset()

    running = [asyncio.create_task(run(1 + number % ADDRESSES)) for number in range(16)]
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await asyncio.gather(*running)
