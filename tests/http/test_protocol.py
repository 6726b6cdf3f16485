from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from bunraku.http import protocol
from bunraku.runtime import transport
from tests.servers import run_server

TIMEOUT_S = 20


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(protocol, "HEADER_TIMEOUT_S", 0.5)
        with run_server(Path(tmp_path_factory.mktemp("header-timeout"))) as url:
            yield url


async def open_connection(url: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    parts = urlsplit(url)
    return await asyncio.open_connection(parts.hostname, parts.port)


async def read_until_closed(reader: asyncio.StreamReader) -> bytes:
    """Return all data until the end of the connection."""
    received = b""
    async with asyncio.timeout(TIMEOUT_S):
        with contextlib.suppress(ConnectionError):
            while more := await reader.read(65_536):
                received += more
    return received


async def test_incomplete_headers_end_the_connection(url: str) -> None:
    for half in (b"", b"GET", b"GET /v1/health HTTP/1.1\r\nHost: s"):
        reader, writer = await open_connection(url)
        writer.write(half)
        assert await read_until_closed(reader) == b""
        writer.close()


async def test_timeout_applies_to_each_request_of_a_connection(url: str) -> None:
    reader, writer = await open_connection(url)
    request = b"GET /v1/health HTTP/1.1\r\nHost: stage\r\n\r\n"
    for _ in range(3):
        writer.write(request[:20])
        await writer.drain()
        writer.write(request[20:])
        answer = await reader.readuntil(b"}")
        assert answer.startswith(b"HTTP/1.1 200")
    writer.write(request[:20])
    assert await read_until_closed(reader) == b""
    writer.close()


async def test_timeout_applies_to_the_rest_of_an_answered_body(url: str) -> None:
    reader, writer = await open_connection(url)
    writer.write(b"POST /v1/nothing HTTP/1.1\r\nHost: stage\r\nContent-Length: 100000\r\n\r\n")

    async def drip() -> None:
        with contextlib.suppress(ConnectionError):
            while True:
                writer.write(b"x")
                await writer.drain()
                await asyncio.sleep(0.05)

    dripping = asyncio.create_task(drip())
    assert (await read_until_closed(reader)).startswith(b"HTTP/1.1 404")
    dripping.cancel()
    await asyncio.gather(dripping, return_exceptions=True)
    writer.close()


async def test_connection_continues_after_the_rest_of_a_body(url: str) -> None:
    reader, writer = await open_connection(url)
    writer.write(b"POST /v1/nothing HTTP/1.1\r\nHost: stage\r\nContent-Length: 10\r\n\r\n")
    assert (await reader.readuntil(b"}")).startswith(b"HTTP/1.1 404")
    writer.write(b"x" * 10 + b"GET /v1/health HTTP/1.1\r\nHost: stage\r\n\r\n")
    assert b'"ok"' in await reader.readuntil(b"}")
    writer.close()


async def exchange(url: str, *pieces: bytes) -> bytes:
    """Send `pieces` and return all data until the server ends the connection."""
    reader, writer = await open_connection(url)
    with contextlib.suppress(ConnectionError):
        for piece in pieces:
            writer.write(piece)
            await writer.drain()
    received = await read_until_closed(reader)
    writer.close()
    return received


UPGRADE = (
    b"GET /v1/sessions/none/stream HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
)


@pytest.mark.parametrize(
    ("data", "status"),
    [
        (UPGRADE + b"Content-Length: 10\r\n\r\n", 400),
        (UPGRADE + b"Transfer-Encoding: chunked\r\n\r\n", 400),
        (UPGRADE + b"a: b\r\n" * 129 + b"\r\n", 431),
        (UPGRADE + b"a: " + b"b" * 9_000 + b"\r\n\r\n", 431),
        (UPGRADE.replace(b"none", b"n" * 9_000) + b"\r\n", 414),
        (UPGRADE + b"\r\n" + b"\x89\x80\0\0\0\0" * 1_000, 400),
        (UPGRADE.replace(b"Version: 13", b"Version: 12") + b"\r\n", 400),
        (UPGRADE.replace(b"GET", b"POST") + b"\r\n", 405),
        (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"a: " + b"b" * 100 + b"\r\n" * 2, 200),
        (b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + (b"a: " + b"b" * 1_000 + b"\r\n") * 120 + b"\r\n", 431),
        (
            b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
            400,
        ),
        (b"nonsense\r\n\r\n", 400),
        (b"POST /v1/solve HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\nnonsense\r\n", 400),
    ],
)
async def test_malformed_request_is_answered_and_closed(url: str, data: bytes, status: int) -> None:
    received = await exchange(url, data)
    # a connection whose response has begun is aborted
    assert received.startswith(b"HTTP/1.1 %d" % status) or (status == 400 and received == b"")
    if status in (414, 431):
        assert b"application/problem+json" in received
        assert b'"status": %d' % status in received


async def test_response_to_a_client_that_does_not_read_is_bounded(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "WRITE_WINDOW_S", 0.2)
    _, writer = await open_connection(url)
    # many responses to one client, which reads none of them
    request = b"GET /v1/openapi.json HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    async with asyncio.timeout(TIMEOUT_S):
        with contextlib.suppress(ConnectionError):
            while True:
                writer.write(request)
                await writer.drain()
                await asyncio.sleep(0.01)
    writer.close()


async def test_body_in_tiny_chunks_does_not_delay_others(url: str) -> None:
    head = b"POST /v1/motions?filename=a.bvh HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    flooding = asyncio.create_task(exchange(url, head + b"1\r\nx\r\n" * 50_000 + b"0\r\n\r\n"))
    answered = 0
    while not flooding.done():
        reader, writer = await open_connection(url)
        writer.write(b"GET /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
        assert b'"ok"' in await read_until_closed(reader)
        writer.close()
        answered += 1
    # several requests are served while the body is parsed
    assert answered > 3
    assert (await flooding)[:9] == b"HTTP/1.1 "


async def test_oldest_waiting_connection_makes_room_for_a_new_one(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "MAX_PENDING_CONNECTIONS", 5)
    monkeypatch.setattr(protocol, "HEADER_TIMEOUT_S", 60.0)
    waiting = [await open_connection(url) for _ in range(5)]
    for _ in range(5):
        assert b'"ok"' in await exchange(
            url, b"GET /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
        )
    assert await read_until_closed(waiting[0][0]) == b""
    for _, writer in waiting:
        writer.close()
