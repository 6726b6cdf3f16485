"""The real gateway with deploy/Caddyfile against hostile clients: time, size, ambiguous requests, forged addresses."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx2
import pytest
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve

from tests.conftest import REPOSITORY
from tests.connection_limit import limit_connections
from tests.credentials import SECRET
from tests.processes import ServerProcess, find_program, free_port
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S

CADDYFILE = (REPOSITORY / "deploy" / "Caddyfile").read_text()
BURST = 10
"""Requests that an address may send at once."""
REJECTED_CONNECTIONS = 4
"""Connections of which at least one must be closed once its request has been rejected."""


@contextmanager
def run_gateway(folder: Path, service_port: int, patch: pytest.MonkeyPatch, **environment: str) -> Iterator[int]:
    """Run Caddy in front of one service in place of all; yield its port."""
    program, port, health_port = find_program("caddy"), free_port(), free_port()
    text, count = re.subn(r"dynamic a \w+ 8000 \{\s+refresh 1s\s+\}", f"to 127.0.0.1:{service_port}", CADDYFILE)
    assert count == 6
    for original, replacement in (
        ("127.0.0.1:8079", f"127.0.0.1:{health_port}"),
        ("read_header 10s", "read_header 1s"),
        ("idle 60s", "idle 1s"),
    ):
        assert original in text
        text = text.replace(original, replacement)
    (folder / "Caddyfile").write_text(text)
    for name, value in {"XDG_DATA_HOME": str(folder), "XDG_CONFIG_HOME": str(folder), **environment}.items():
        patch.setenv(name, value)
    patch.setenv("BUNRAKU_SITE", f":{port}")
    command = [program, "run", "--config", str(folder / "Caddyfile"), "--adapter", "caddyfile"]
    process = ServerProcess(command, port, folder)
    try:
        process.start()
        yield port
    finally:
        process.stop()


class RecordingService:
    """Service that records the head of every request, and answers with `response` without reading a body."""

    def __init__(self, response: bytes, status: bytes) -> None:
        self._response, self._status = response, status
        self.heads: list[bytes] = []
        self.aborted = asyncio.Event()
        self.connections: set[asyncio.Task[None]] = set()

    def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections.add(asyncio.create_task(self._serve(reader, writer)))

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError, asyncio.IncompleteReadError):
            self.heads.append(await reader.readuntil(b"\r\n\r\n"))
            length = len(self._response)
            writer.write(b"HTTP/1.1 %b\r\nConnection: close\r\nRetry-After: 7\r\n" % self._status)
            writer.write(b"Content-Length: %d\r\n\r\n" % length)
            writer.write(self._response)
            try:
                await writer.drain()
            except OSError:
                self.aborted.set()
            else:
                # as the services do: closing with unread input would discard the response
                writer.write_eof()
                await reader.read()
        writer.close()


@asynccontextmanager
async def run_recording_service(
    response: bytes = b"ok", status: bytes = b"200 OK"
) -> AsyncIterator[tuple[RecordingService, int]]:
    service = RecordingService(response, status)
    listening = await asyncio.start_server(service.accept, "127.0.0.1", 0)
    try:
        yield service, listening.sockets[0].getsockname()[1]
    finally:
        listening.close()
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await asyncio.gather(*service.connections)


async def send_and_read(port: int, data: bytes) -> bytes:
    """Send bytes and return everything until the gateway closes the connection."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(data)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            with suppress(ConnectionError):
                return await reader.read()
            return b""
    finally:
        writer.close()


SILENT_CLIENTS = (
    b"",
    b"GET /v1/motions HTTP/1.1\r\nHost: a\r\nX-Slow: ",
    # a complete request, then silence
    b"GET /livez HTTP/1.1\r\nHost: a\r\n\r\n",
    # a body that does not arrive, at the gateway itself and at a service
    b"POST /livez HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n",
    b"POST /v1/solve HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\nx",
    b"POST /v1/solve HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhe",
)


async def test_silent_client_is_disconnected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_recording_service() as (_, service_port):
        with run_gateway(tmp_path, service_port, monkeypatch, BUNRAKU_REQUEST_TIMEOUT="1s") as port:
            await asyncio.gather(*(send_and_read(port, data) for data in SILENT_CLIENTS))


UPGRADE = b"GET /v1/sessions/a/stream HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
BODIES_THAT_DO_NOT_ARRIVE = (
    b"POST /v1/solve HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\nx",
    b"POST /v1/motions HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhe",
    b"DELETE /v1/shares/a HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\n",
    UPGRADE + b"Content-Length: 5\r\n\r\n",
    UPGRADE + b"Transfer-Encoding: chunked\r\n\r\n",
)


async def receive_rejection(port: int, request: bytes, status: bytes) -> None:
    """Send a request whose body does not arrive; check that it is rejected and that its connection is closed.

    One of some hundred such connections is left open: Go aborts the read of the body and with it its deadline, and then
    reads what remains. So that it is not taken for the rule, one of several connections must be closed.
    """
    connections = [await asyncio.open_connection("127.0.0.1", port) for _ in range(REJECTED_CONNECTIONS)]
    ends = []
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            for reader, writer in connections:
                writer.write(request)
                response = await reader.readuntil(b"\r\n\r\nno")
                assert response.startswith(b"HTTP/1.1 " + status)
                assert b"\r\nRetry-After: 7\r\n" in response
                ends.append(asyncio.create_task(reader.read()))
            await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for end in ends:
            end.cancel()
        await asyncio.gather(*ends, return_exceptions=True)
        for _, writer in connections:
            writer.close()


@pytest.mark.parametrize("status", [b"400 Bad Request", b"401 Unauthorized", b"503 Service Unavailable"])
async def test_rejection_does_not_wait_for_the_body(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: bytes
) -> None:
    async with run_recording_service(b"no", status) as (_, service_port):
        with run_gateway(tmp_path, service_port, monkeypatch) as port:
            await asyncio.gather(*(receive_rejection(port, data, status) for data in BODIES_THAT_DO_NOT_ARRIVE))


async def test_large_headers_are_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    large = b"x" * (32 << 10)
    async with run_recording_service() as (service, service_port):
        with run_gateway(tmp_path, service_port, monkeypatch) as port:
            for head in (
                b"GET / HTTP/1.1\r\nHost: a\r\nX-Large: " + large,
                b"GET /" + large + b" HTTP/1.1\r\nHost: a",
                b"GET / HTTP/1.1\r\nHost: a\r\n" + b"\r\n".join(b"X-%d: 1" % number for number in range(4000)),
            ):
                answer = await send_and_read(port, head + b"\r\n\r\n")
                assert answer.startswith((b"HTTP/1.1 431 ", b"")), answer[:80]
                assert b" 200 " not in answer[:20]
        assert service.heads == []


async def test_unread_response_is_aborted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_recording_service(bytes(64 << 20)) as (service, service_port):
        with run_gateway(tmp_path, service_port, monkeypatch, BUNRAKU_REQUEST_TIMEOUT="1s") as port:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
            # asyncio stops to read once its buffer is full
            async with asyncio.timeout(HANG_TIMEOUT_S):
                await service.aborted.wait()
            writer.close()
            del reader


AMBIGUOUS_FRAMINGS = (
    b"Content-Length: 5\r\nTransfer-Encoding: chunked",
    b"Transfer-Encoding: chunked\r\nContent-Length: 5",
    b"Content-Length: 5\r\nContent-Length: 6",
    b"Content-Length: 5, 6",
    b"Content-Length: +5",
    b"Content-Length: 5\r\nTransfer-Encoding: xchunked",
    b"Content-Length: 5\r\nTransfer-Encoding: chunked, identity",
    b"Content-Length: 5\r\nTransfer-Encoding : chunked",
    b"Content-Length: 5\r\nTransfer-Encoding:\x0bchunked",
    b"Content-Length: 5\r\nX: a\nTransfer-Encoding: chunked",
    b"Content-Length: 5\r\n Transfer-Encoding: chunked",
)


async def test_ambiguous_framing_is_not_forwarded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    smuggled = b"0\r\n\r\nGET /smuggled HTTP/1.1\r\nHost: a\r\n\r\n"
    async with run_recording_service() as (service, service_port):
        with run_gateway(tmp_path, service_port, monkeypatch, BUNRAKU_REQUEST_TIMEOUT="1s") as port:
            head = b"POST /v1/solve HTTP/1.1\r\nHost: a\r\n"
            requests = [head + framing + b"\r\n\r\n" + smuggled for framing in AMBIGUOUS_FRAMINGS]
            await asyncio.gather(*(send_and_read(port, data) for data in requests))
        for head in service.heads:
            names = [line.partition(b":")[0].strip().lower() for line in head.split(b"\r\n")[1:]]
            # the gateway frames the body anew, in one way
            assert names.count(b"content-length") + names.count(b"transfer-encoding") <= 1, head
            assert b"\n" not in head.replace(b"\r\n", b"")


async def test_websocket_outlives_the_request_timeout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def serve_socket(socket: ServerConnection) -> None:
        async for message in socket:
            await socket.send(message)

    async with serve(serve_socket, "127.0.0.1", 0) as listening:
        service_port = next(iter(listening.sockets)).getsockname()[1]
        with run_gateway(tmp_path, service_port, monkeypatch, BUNRAKU_REQUEST_TIMEOUT="1s") as port:
            async with connect(f"ws://127.0.0.1:{port}/v1/sessions/a/stream", ping_interval=None) as socket:
                # HTTP requests that begin later are ended by the timeout meanwhile
                await send_and_read(port, b"POST /livez HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n")
                await socket.send("still here")
                assert await socket.recv() == "still here"


@pytest.mark.parametrize(
    ("gateway_proxies", "forwarded", "limited"),
    [
        # without a proxy in front, the gateway replaces the header of the client
        ("192.0.2.0/24", "203.0.113.{number}", True),
        # the client of this test is the proxy in front, which appends the real address
        ("127.0.0.0/8", "203.0.113.{number}, 198.51.100.1", True),
        ("127.0.0.0/8", "203.0.113.{number}", False),
    ],
)
async def test_forged_address_does_not_evade_a_limit(
    gateway_proxies: str, forwarded: str, limited: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options: dict[str, Any] = {
        "secret": SECRET,
        "connects": limit_connections(monkeypatch, BURST),
        # as docker-compose.yml
        "trusted_proxies": f"* {gateway_proxies}",
    }
    with (
        run_server(tmp_path / "data", services=["stream"], **options) as url,
        run_gateway(tmp_path, int(url.rpartition(":")[2]), monkeypatch, BUNRAKU_PROXIES=gateway_proxies) as port,
    ):
        async with httpx2.AsyncClient(base_url=f"http://127.0.0.1:{port}") as http:
            path = "/v1/motions/m1/description"
            statuses = [
                (await http.get(path, headers={"X-Forwarded-For": forwarded.format(number=number)})).status_code
                for number in range(2 * BURST)
            ]
    assert statuses[:BURST] == [401] * BURST
    assert (429 in statuses) is limited


async def test_rejected_body_does_not_harm_other_requests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The gateway sends the requests of all clients on the same connections to a service."""
    with (
        run_server(tmp_path / "data") as url,
        run_gateway(tmp_path, int(url.rpartition(":")[2]), monkeypatch) as port,
    ):
        async with httpx2.AsyncClient(base_url=f"http://127.0.0.1:{port}") as http:
            for _ in range(5):
                assert (await http.post("/v1/nothing", content=bytes(200_000))).status_code == 404
                assert (await http.post("/v1/solve", json={})).status_code in (400, 422)


@pytest.mark.parametrize("accepted", ["", "Accept-Encoding: gzip\r\n", "Accept-Encoding: br\r\n"])
async def test_gateway_asks_for_the_encoding_that_the_client_accepts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, accepted: str
) -> None:
    # otherwise a client without gzip makes it decompress each file of the page
    async with run_recording_service() as (service, service_port):
        with run_gateway(tmp_path, service_port, monkeypatch) as port:
            request = f"GET / HTTP/1.1\r\nHost: a\r\n{accepted}Connection: close\r\n\r\n"
            response = await send_and_read(port, request.encode())
    assert b"content-length: 2" in response.lower()
    (head,) = service.heads
    sent = [line for line in head.decode().split("\r\n") if line.lower().startswith("accept-encoding")]
    assert sent == ([accepted.strip()] if accepted else [])
