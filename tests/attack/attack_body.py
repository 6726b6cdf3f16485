"""Large and hostile request bodies: rows 5, 6 and 18."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable

from tests.attack.attack_socket import flood
from tests.attack.raw_socket import OPEN, fetch, open_socket, request
from tests.attack.registry import Report, Target, attack

CALM = "others' overlay gap p99 <= 1.3x calm; RSS +50 MB at most"
PROPORTIONS = "393-351-256-560-320-120"
JSON = "Content-Type: application/json"
MSGPACK = "Content-Type: application/msgpack"
MEGABYTE = 1 << 20
CLIENTS = 4
"""Connections that send the same body at the same time."""


def json_bodies(size: int) -> dict[str, bytes]:
    """Return hostile JSON documents of about `size` bytes, for any route."""
    return {
        "empty maps": b"[" + b"{}," * (size // 3) + b"{}]",
        "targets of empty maps": b'{"proportions":"a","targets":[' + b"{}," * (size // 3) + b"{}]}",
        "nested arrays": b"[" * size,
        "nested maps": b'{"a":' * (size // 5),
        "closed nested arrays": b"[" * (size // 2) + b"]" * (size // 2),
        "empty arrays": b'{"lights":[' + b"[]," * (size // 3) + b"[]]}",
        "small integers": b'{"targets":[' + b"1," * (size // 2) + b"1]}",
        "one integer": b'{"targets":' + b"9" * size + b"}",
        "one string": b'{"proportions":"' + b"a" * size + b'"}',
        "escapes": b'{"proportions":"' + b"\\u0000" * (size // 6) + b'"}',
        "equal keys": b"{" + b'"a":1,' * (size // 6) + b'"a":1}',
        "different keys": b"{" + b",".join(b'"%d":0' % number for number in range(size // 12)) + b"}",
        "white space": b" " * size,
        "exponents": b'{"targets":[' + b"1e308," * (size // 6) + b"1]}",
        "NaN": b'{"targets":[' + b"[NaN,NaN,NaN]," * (size // 14) + b"[0,0,0]]}",
        "UTF-16": ('{"a":"' + "b" * (size // 2) + '"}').encode("utf-16"),
        "brackets in a string": b'{"proportions":"' + b"[{" * (size // 2) + b'"}',
        "quotes": b'"' * size,
    }


def msgpack_bodies(size: int) -> dict[str, bytes]:
    """Return hostile MessagePack documents of about `size` bytes."""
    head = b"\x81\xa7targets"
    length = size.to_bytes(4, "big")
    return {
        "empty arrays": head + b"\xdd" + length + b"\x90" * size,
        "empty maps": head + b"\xdd" + length + b"\x80" * size,
        "nils": head + b"\xdd" + length + b"\xc0" * size,
        "nested arrays": b"\x91" * size,
        "nested maps": b"\x81\xa1a" * (size // 3),
        "wide and nested": b"\xdc\xff\xff" * (size // 3),
        "array with a lying length": head + b"\xdd\xff\xff\xff\xff",
        "map with a lying length": b"\xdf\xff\xff\xff\xff",
        "string with a lying length": head + b"\xdb\xff\xff\xff\xff" + b"a" * 100,
        "binary with a lying length": head + b"\xc6\x7f\xff\xff\xff" + b"a" * 100,
        "extension with a lying length": head + b"\xc9\x7f\xff\xff\xff\x01",
        "extensions": head + b"\xdd" + (size // 3).to_bytes(4, "big") + b"\xd4\x05\x00" * (size // 3),
        "timestamps": head + b"\xdd" + (size // 6).to_bytes(4, "big") + b"\xd6\xff\0\0\0\1" * (size // 6),
        "one binary": head + b"\xc6" + length + bytes(size),
        "keys of a map": b"\xdf" + (size // 6).to_bytes(4, "big")
        + b"".join(b"\xce" + number.to_bytes(4, "big") + b"\xc0" for number in range(size // 6)),
        "equal hashes": b"\xdf" + (size // 18).to_bytes(4, "big")
        + b"".join(b"\xcf" + (number * ((1 << 61) - 1)).to_bytes(8, "big") + b"\xcb" + bytes(8)
                   for number in range(min(size // 18, 8))),
        "reserved byte": b"\xc1" * size,
    }  # fmt: skip


async def post_repeatedly(
    target: Target, report: Report, path: str, kind: str, bodies: Callable[[int], bytes], role: str = "view"
) -> None:
    """Send bodies from `CLIENTS` connections until the attack ends."""
    until = time.monotonic() + target.seconds

    async def run(client: int) -> None:
        number = client
        while time.monotonic() < until:
            left = max(until - time.monotonic(), 1.0) + 10.0
            response = await fetch(
                target, "POST", path, kind, token=target.tokens[role], body=bodies(number), address=client + 1,
                timeout_s=left,
            )  # fmt: skip
            number += CLIENTS
            status = response.status if response else None
            report.count(str(status or "closed without an answer"))
            busy = response is not None and status == 503 and "retry-after" in response.headers
            report.require(status is None or status < 500 or busy, f"a body was answered with {status}")
            if status is None or status >= 400:
                await asyncio.sleep(0.02)

    await asyncio.gather(*(run(client) for client in range(CLIENTS)))


@attack(5, CALM, probe="solve")
async def solve_of_100_000_targets(target: Target, report: Report) -> None:
    """Solve 100,000 targets again and again on four connections."""
    body = json.dumps({"proportions": PROPORTIONS, "targets": [[0.4, 0.1, 0.4]] * 100_000}).encode()
    attacking = asyncio.create_task(post_repeatedly(target, report, "/v1/solve", JSON, lambda _: body))
    await asyncio.sleep(target.seconds / 2)
    await report.reach_peak()
    await attacking


@attack(5, CALM)
async def solve_of_the_largest_batch(target: Target, report: Report) -> None:
    """Solve as many targets as are accepted, as MessagePack, from eight addresses."""
    for count in (100_000, 50_000, 20_000, 10_000, 5_000, 1_000):
        body = json.dumps({"proportions": PROPORTIONS, "targets": [[0.4, 0.1, 0.4]] * count}).encode()
        response = await fetch(target, "POST", "/v1/solve", JSON, token=target.tokens["view"], body=body)
        if response is not None and response.status == 200:
            report.count(f"{count} targets")
            await post_repeatedly(target, report, "/v1/solve", JSON, lambda _, accepted=body: accepted)  # type: ignore[misc]
            return


@attack(5, CALM, quick=True)
async def solve_of_empty_arrays(target: Target, report: Report) -> None:
    """Send 16 MB of MessagePack with empty arrays as targets."""
    body = msgpack_bodies(16 * MEGABYTE - 64)["empty arrays"]
    await post_repeatedly(target, report, "/v1/solve", MSGPACK, lambda _: body)


@attack(5, CALM, seconds=6.0)
async def solve_of_hostile_json(target: Target, report: Report) -> None:
    """Send hostile JSON documents of 1 to 16 MB to the solver."""
    bodies = [body for size in (MEGABYTE, 15 * MEGABYTE) for body in json_bodies(size).values()]
    await post_repeatedly(target, report, "/v1/solve", JSON, lambda number: bodies[number % len(bodies)])


@attack(5, CALM, seconds=6.0)
async def solve_of_hostile_messagepack(target: Target, report: Report) -> None:
    """Send hostile MessagePack documents of 1 to 8 MB to the solver."""
    bodies = [body for size in (MEGABYTE, 8 * MEGABYTE) for body in msgpack_bodies(size).values()]
    await post_repeatedly(target, report, "/v1/solve", MSGPACK, lambda number: bodies[number % len(bodies)])


@attack(5, CALM)
async def small_bodies_of_hostile_json(target: Target, report: Report) -> None:
    """Send hostile JSON documents of 60 kB to routes with small bodies."""
    bodies = list(json_bodies(60_000).values())
    await asyncio.gather(
        post_repeatedly(target, report, "/v1/sessions", JSON, lambda number: bodies[number % len(bodies)], "control"),
        post_repeatedly(target, report, "/v1/shares", JSON, lambda number: bodies[number % len(bodies)], "control"),
    )


@attack(5, f"{CALM}; the connection is ended", quick=True)
async def body_in_single_byte_chunks(target: Target, report: Report) -> None:
    """Send bodies in 1-byte chunks as fast as possible to several routes."""

    async def run(path: str, role: str, number: int) -> None:
        async with open_socket(target, address=1 + number) as opened:
            head = request(target, "POST", path, JSON, "Transfer-Encoding: chunked", token=target.tokens[role])
            await opened.send(head)
            sent = await flood(opened, b"1\r\n \r\n" * 10_000, time.monotonic() + target.seconds)
            # a server that answers early may discard the rest of the body for some seconds
            response = await opened.read_response(1.0)
            status = str(response.status) if response else "closed" if opened.is_closed else OPEN
            report.count(status)
            report.require(
                status != OPEN or sent < 2_000_000, f"{path}: {sent // 6:,} chunks of one byte were accepted"
            )

    routes = (
        ("/v1/solve", "view"), ("/v1/motions?filename=a.bvh", "ingest"), ("/v1/sessions", "control"),
        (f"/v1/motions/{target.motion}/scene", "ingest"),
    )  # fmt: skip
    await asyncio.gather(*(run(*route, number) for number, route in enumerate(routes * 2)))


@attack(5, f"{CALM}; the connection is ended", seconds=8.0)
async def body_in_single_byte_segments(target: Target, report: Report) -> None:
    """Send bodies with a length, each byte in a separate TCP segment, on twenty connections."""

    async def run(number: int) -> None:
        async with open_socket(target, address=1 + number % 4) as opened:
            head = request(target, "POST", "/v1/solve", JSON, "Content-Length: 1000000", token=target.tokens["view"])
            await opened.send(head)
            await flood(opened, b" " * 1_000, time.monotonic() + target.seconds, 1)
            report.count("closed" if opened.is_closed else OPEN)

    await asyncio.gather(*(run(number) for number in range(20)))


@attack(6, CALM, quick=True)
async def scene_of_empty_maps(target: Target, report: Report) -> None:
    """Send 16 MB of `{},{},` as lights of a scene."""
    body = b'{"lights":[[' + b"{}," * (5 * MEGABYTE) + b"{}]]}"
    await post_repeatedly(target, report, f"/v1/motions/{target.motion}/scene", JSON, lambda _: body, "ingest")


@attack(6, CALM, seconds=6.0)
async def hostile_scenes(target: Target, report: Report) -> None:
    """Send hostile JSON documents of 1 to 16 MB as scenes."""
    bodies = [body for size in (MEGABYTE, 15 * MEGABYTE) for body in json_bodies(size).values()]
    path = f"/v1/motions/{target.motion}/scene"
    await post_repeatedly(target, report, path, JSON, lambda number: bodies[number % len(bodies)], "ingest")


@attack(6, CALM, seconds=6.0)
async def hostile_recordings(target: Target, report: Report) -> None:
    """Send hostile JSON documents of 1 to 16 MB as camera of a recording."""
    bodies = [body for size in (MEGABYTE, 15 * MEGABYTE) for body in json_bodies(size).values()]
    bodies.append(b'{"camera":[' + b"{}," * (5 * MEGABYTE) + b"{}]}")
    path = f"/v1/sessions/{target.session}/recordings"
    await post_repeatedly(target, report, path, JSON, lambda number: bodies[number % len(bodies)], "ingest")


@attack(6, CALM, max_rss_growth_mb=80.0)
async def valid_scenes_of_the_largest_size(target: Target, report: Report) -> None:
    """Send valid scenes with eight lights of 10,000 keyframes each."""
    light = [{"time": number, "position": [0, 1, 0], "colour": [1, 1, 1], "intensity": 1} for number in range(10_000)]
    body = json.dumps({"lights": [light] * 8}).encode()
    path = f"/v1/motions/{target.motion}/scene"
    await post_repeatedly(target, report, path, JSON, lambda number: body[:-1] + b" " * number + b"}", "ingest")


@attack(18, "no traceback in the log", quick=True)
async def requests_whose_client_is_gone(target: Target, report: Report) -> None:
    """Reset connections in the middle of a body and while the response is made, on every route with a body."""
    routes = [
        ("/v1/solve", "view"), ("/v1/sessions", "control"), ("/v1/shares", "control"), ("/v1/tickets", "view"),
        ("/v1/motions?filename=a.bvh", "ingest"), (f"/v1/motions/{target.motion}/audio?filename=a.wav", "ingest"),
        (f"/v1/motions/{target.motion}/scene", "ingest"), (f"/v1/motions/{target.motion}/performers", "ingest"),
        (f"/v1/sessions/{target.session}/recordings", "ingest"),
    ]  # fmt: skip
    body = json.dumps({"proportions": PROPORTIONS, "targets": [[0.4, 0.1, 0.4]] * 500}).encode()
    for path, role in routes:
        for sent in (0, 10, len(body)):
            async with open_socket(target) as opened:
                head = request(target, "POST", path, JSON, f"Content-Length: {len(body)}", token=target.tokens[role])
                await opened.send(head + body[:sent])
                await asyncio.sleep(0.03)
                opened.reset()
                report.count("reset")
        async with open_socket(target) as opened:
            chunked = request(target, "POST", path, JSON, "Transfer-Encoding: chunked", token=target.tokens[role])
            await opened.send(chunked + b"5\r\n{}")
            await asyncio.sleep(0.03)
            opened.end_sending()
            report.count(await opened.describe_reaction(2.0))
