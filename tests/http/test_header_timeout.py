from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from bunraku.http import header_timeout
from tests.servers import run_server

TIMEOUT_S = 20


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(header_timeout, "HEADER_TIMEOUT_S", 0.5)
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
