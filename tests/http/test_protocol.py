from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import h11
import pytest
import uvicorn
from uvicorn.server import ServerState

from bunraku import serve
from bunraku.http import protocol, request_body
from bunraku.http.protocol import HttpLoad, HttpProtocol
from bunraku.runtime import transport
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S


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
    async with asyncio.timeout(HANG_TIMEOUT_S):
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


@pytest.mark.parametrize("fields", [b"Content-Length: 200000\r\n", b"Transfer-Encoding: chunked\r\n"])
async def test_connection_with_a_long_rest_of_a_body_is_not_used_again(url: str, fields: bytes) -> None:
    """A proxy would send the next request of another client on it."""
    reader, writer = await open_connection(url)
    writer.write(b"POST /v1/nothing HTTP/1.1\r\nHost: stage\r\n" + fields + b"\r\n30d40\r\n" + b"x" * 1_000)
    response = (await read_until_closed(reader)).lower()
    assert response.startswith(b"http/1.1 404")
    assert response.count(b"connection: close") == 1
    writer.close()


async def test_response_is_received_by_a_client_that_closes_and_still_sends(url: str) -> None:
    parts = urlsplit(url)
    assert parts.hostname is not None
    head = b"POST /v1/nothing HTTP/1.1\r\nHost: stage\r\nConnection: close\r\nContent-Length: 4000000\r\n\r\n"
    with socket.create_connection((parts.hostname, parts.port or 80), HANG_TIMEOUT_S) as client:
        await asyncio.to_thread(client.sendall, head)
        assert (await asyncio.to_thread(client.recv, 12)) == b"HTTP/1.1 404"
        # the connection is open for what is still sent: data to a closed one would be answered with a reset
        for _ in range(3):
            await asyncio.to_thread(client.sendall, bytes(100_000))
        received = b""
        while more := await asyncio.to_thread(client.recv, 65_536):
            received += more
        assert received.endswith(b"}")


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


MALFORMED_REQUESTS = (
    (UPGRADE + b"Content-Length: 10\r\n\r\n", 400),
    (UPGRADE + b"Transfer-Encoding: chunked\r\n\r\n", 400),
    (UPGRADE + b"a: b\r\n" * 129 + b"\r\n", 431),
    (UPGRADE + b"Sec-WebSocket-Protocol: ,,\x7f\r\n\r\n", 400),
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
)
"""Requests, and the status of the response to each."""


@pytest.fixture(scope="module")
def answers(url: str) -> list[bytes]:
    """Return the response to each malformed request. The server keeps each connection for a while: all side by side."""

    async def send_all() -> list[bytes]:
        return await asyncio.gather(*(exchange(url, data) for data, _ in MALFORMED_REQUESTS))

    return asyncio.run(send_all())


@pytest.mark.parametrize("number", range(len(MALFORMED_REQUESTS)))
def test_malformed_request_is_answered_and_closed(answers: list[bytes], number: int) -> None:
    received, status = answers[number], MALFORMED_REQUESTS[number][1]
    # a connection whose response has begun is aborted
    assert received.startswith(b"HTTP/1.1 %d" % status) or (status == 400 and received == b"")
    if status in (414, 431):
        assert b"application/problem+json" in received
        assert b'"status": %d' % status in received


async def test_rejection_of_a_head_request_has_no_body(url: str) -> None:
    head = b"HEAD /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    received = await exchange(url, head + b"a: " + b"b" * 9_000 + b"\r\n\r\n")
    assert received.startswith(b"HTTP/1.1 431")
    assert received.endswith(b"\r\n\r\n")
    # the next request of a connection is not one with HEAD
    received = await exchange(url, head + b"\r\nnonsense\r\n\r\n")
    assert received.count(b"HTTP/1.1 ") == 2
    assert b'"status": 400' in received


async def test_response_to_a_client_that_does_not_read_is_bounded(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "WRITE_WINDOW_S", 0.2)
    _, writer = await open_connection(url)
    # many responses to one client, which reads none of them
    request = b"GET /v1/openapi.json HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with contextlib.suppress(ConnectionError):
            while True:
                writer.write(request)
                await writer.drain()
                await asyncio.sleep(0.01)
    writer.close()


async def test_small_responses_to_a_client_that_does_not_read_are_bounded(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport, "WRITE_WINDOW_S", 0.2)
    parts = urlsplit(url)
    with socket.socket() as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_096)
        client.connect((parts.hostname, parts.port))
        client.setblocking(False)
        # their responses are far less than the kernel would accept for one connection
        requests = b"GET /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 5_000
        sending = asyncio.create_task(asyncio.get_running_loop().sock_sendall(client, requests))

        def is_reset() -> bool:
            failed = sending.done() and sending.exception() is not None
            return failed or client.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) != 0

        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not is_reset():  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)


class RecordingTransport(asyncio.Transport):
    """Transport that records whether reading is paused."""

    def __init__(self) -> None:
        super().__init__({"socket": None, "sockname": ("127.0.0.1", 80), "peername": ("127.0.0.1", 9)})
        self.protocol: asyncio.BaseProtocol
        self.is_paused = False
        self.is_closed = False

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...

    def get_protocol(self) -> asyncio.BaseProtocol:
        return self.protocol

    def pause_reading(self) -> None:
        self.is_paused = True

    def resume_reading(self) -> None:
        self.is_paused = False

    def write(self, _: bytes | bytearray | memoryview) -> None: ...

    def is_closing(self) -> bool:
        return self.is_closed

    def close(self) -> None:
        self.is_closed = True

    def abort(self) -> None:
        self.is_closed = True


async def test_body_in_tiny_chunks_is_parsed_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(request_body, "MAX_SMALL_CHUNKS", 100_000)

    async def app(_: object, receive: Callable[[], Awaitable[dict[str, object]]], __: object) -> None:
        while (await receive())["type"] != "http.disconnect":
            continue

    config = uvicorn.Config(app, lifespan="off", log_config=None)
    config.load()
    load = HttpLoad()
    connections = [HttpProtocol(load, config, ServerState(), {}) for _ in range(2)]
    transports = [RecordingTransport() for _ in connections]
    for connection, connected in zip(connections, transports, strict=True):
        connected.protocol = connection
        connection.connection_made(connected)
    first, second = connections
    first.data_received(b"POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n" + b"1\r\nx\r\n" * 10_000)
    # this takes far longer than a turn, so that the rest waits and nothing more is read
    assert load.input.is_busy
    assert transports[0].is_paused
    # data of others waits for its turn, not for the end of the first body
    second.data_received(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
    assert second.conn.their_state is h11.IDLE
    for _ in range(10):
        # each iteration of the event loop parses data of one connection
        await asyncio.sleep(0)
    assert second.conn.their_state is not h11.IDLE
    assert load.input.is_busy
    for connection, connected in zip(connections, transports, strict=True):
        connected.abort()
        connection.connection_lost(None)
    await asyncio.gather(*first.tasks, *second.tasks, return_exceptions=True)


HEAD = b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1000000\r\n\r\n"


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel reports the size of its buffers on Linux")
@pytest.mark.parametrize(
    ("data", "reads_body", "is_enlarged"),
    [
        (HEAD + b"x" * 1_000, True, True),
        (HEAD + b"x" * 1_000, False, False),
        (b"GET / HTTP/1.1\r\nHost: a\r\n\r\n" * 20, True, False),
    ],
    ids=["body is read", "body is not read", "pipelined requests"],
)
async def test_receive_buffer_is_small_until_the_application_reads_a_body(
    data: bytes, reads_body: bool, is_enlarged: bool
) -> None:
    async def app(_: object, receive: Callable[[], Awaitable[Any]], send: Callable[[Any], Awaitable[None]]) -> None:
        if reads_body:
            await receive()
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
        await send({"type": "http.response.body", "body": b"ok"})

    config = uvicorn.Config(app, lifespan="off", log_config=None)
    config.load()
    connections: list[HttpProtocol] = []

    def accept() -> HttpProtocol:
        connections.append(HttpProtocol(HttpLoad(), config, ServerState(), {}))
        return connections[-1]

    server = await asyncio.get_running_loop().create_server(accept, "127.0.0.1", 0)
    async with server, asyncio.timeout(HANG_TIMEOUT_S):
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
        writer.write(data)
        for _ in range(data.count(b"Host")):
            await reader.readuntil(b"ok")
        accepted = connections[0].transport.get_extra_info("socket")
        # the kernel reports twice the size
        buffer_bytes = accepted.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2
        connections[0].transport.abort()
        await read_until_closed(reader)
        writer.close()
        await writer.wait_closed()
    assert (buffer_bytes > protocol.RECEIVE_BUFFER_BYTES) == is_enlarged


async def test_oldest_waiting_connection_makes_room_for_a_new_one(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "MAX_WAITING_CONNECTIONS", 5)
    monkeypatch.setattr(protocol, "HEADER_TIMEOUT_S", 60.0)
    waiting = [await open_connection(url) for _ in range(5)]
    for _ in range(5):
        assert b'"ok"' in await exchange(
            url, b"GET /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
        )
    assert await read_until_closed(waiting[0][0]) == b""
    for _, writer in waiting:
        writer.close()


async def test_address_that_fills_the_server_keeps_nobody_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(serve, "MAX_FILES", 40)
    request = b"GET /v1/health HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    with run_server(tmp_path) as url:
        port = urlsplit(url).port
        held = [await asyncio.open_connection("127.0.0.1", port, local_addr=("127.0.0.2", 0)) for _ in range(60)]
        # the server closes connections beyond its capacity of 20
        ended = [asyncio.create_task(read_until_closed(reader)) for reader, _ in held]
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while sum(task.done() for task in ended) < 40:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        for _ in range(3):
            assert b'"ok"' in await exchange(url, request + b"Connection: close\r\n\r\n")
        for _, writer in held:
            writer.close()
        await asyncio.gather(*ended)
