from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any
from urllib.parse import urlsplit

import pytest
import uvicorn
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bunraku.runtime.input_scheduler import TURN_US, InputScheduler
from bunraku.websocket import handoff
from bunraku.websocket.connection import BinaryListener, WebSocketConnection
from bunraku.websocket.frame import Opcode, encode_frame
from bunraku.websocket.handoff import HandoffProtocol, detach, reject
from bunraku.websocket.subprotocol import CloseConnection
from tests.raw_client import client_frame, open_raw, upgrade_request
from tests.time_limit import HANG_TIMEOUT_S


class RecordingListener(BinaryListener):
    """Listener that records its events and echoes messages."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self.events: list[str] = []
        self.connection: WebSocketConnection
        self.ended = asyncio.Event()
        self.resumed = asyncio.Event()

    def on_message(self, message: bytes) -> None:
        if message == b"close me":
            raise CloseConnection(4404, "No such motion", "none")
        self.messages.append(message)
        self.connection.write(encode_frame(b"echo " + message))

    def on_pong(self, _: bytes) -> bool:
        return False

    def on_pause(self) -> None:
        self.events.append("pause")

    def on_resume(self) -> None:
        self.events.append("resume")
        self.resumed.set()

    def on_close(self) -> None:
        self.events.append("close")
        self.ended.set()


@asynccontextmanager
async def serve_app(endpoint: Callable[[WebSocket], Awaitable[None]]) -> AsyncIterator[tuple[str, uvicorn.Server]]:
    app = Starlette(routes=[WebSocketRoute("/", endpoint)])
    protocol: Any = partial(HandoffProtocol, InputScheduler(TURN_US))
    config = uvicorn.Config(
        app, ws=protocol, lifespan="off", log_config=None, log_level="warning", ws_per_message_deflate=False
    )
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        serving = asyncio.create_task(server.serve(sockets=[listening]))
        async with asyncio.timeout(HANG_TIMEOUT_S):
            yield f"ws://127.0.0.1:{listening.getsockname()[1]}/", server
            server.should_exit = True
            await serving


@asynccontextmanager
async def detached_client() -> AsyncIterator[tuple[ClientConnection, RecordingListener, uvicorn.Server]]:
    """Yield a client of a detached connection, the listener of that connection, and the server."""
    listener = RecordingListener()

    async def endpoint(ws: WebSocket) -> None:
        await ws.accept()
        listener.connection = detach(ws, listener)
        listener.connection.write(encode_frame(b"hello"))

    async with serve_app(endpoint) as (url, server), connect(url, compression=None, max_size=1 << 21) as client:
        assert await client.recv() == b"hello"
        yield client, listener, server


async def test_detached_connection_sends_receives_and_closes() -> None:
    async with detached_client() as (client, listener, _):
        await client.send(b"one")
        await client.send([b"t", b"w", b"o"])
        assert [await client.recv(), await client.recv()] == [b"echo one", b"echo two"]
        await (await client.ping())
        before = listener.connection.last_received_at
        listener.connection.send_ping()
        await (await client.ping())
        assert listener.connection.last_received_at >= before
        await client.close(1001, "enough")
        await listener.ended.wait()
        assert client.close_code == 1001
        assert listener.events[-1] == "close"
        assert listener.events.count("close") == 1


@pytest.mark.parametrize(
    ("message", "code", "title"),
    [(b"close me", 4404, b"No such motion"), ("text", 1008, b"Text"), (bytes(1025), 1009, b"Too large")],
)
async def test_close_reason_is_sent_before_the_close_code(message: bytes | str, code: int, title: bytes) -> None:
    async with detached_client() as (client, listener, _):
        await client.send(message)
        received = b""
        with pytest.raises(ConnectionClosed):  # noqa: PT012
            while True:
                received += bytes(await client.recv())  # type: ignore[arg-type]
        assert title in received
        assert client.close_code == code
        await listener.ended.wait()


async def test_client_that_stops_reading_pauses_the_connection() -> None:
    async with detached_client() as (client, listener, _):
        block = encode_frame(bytes(1 << 18))
        count = 0
        while listener.connection.is_writable:
            listener.connection.write(block)
            count += 1
            await asyncio.sleep(0)
        assert listener.connection.buffered_bytes > 0
        for _ in range(count):
            assert await client.recv() == bytes(1 << 18)
        await listener.resumed.wait()
        assert listener.events == ["pause", "resume"]
        assert listener.connection.buffered_bytes == 0


async def test_abort_ends_the_connection() -> None:
    async with detached_client() as (client, listener, _):
        listener.connection.abort()
        await listener.ended.wait()
        with pytest.raises(ConnectionClosed):
            await client.recv()


async def test_server_shutdown_closes_detached_connections() -> None:
    async with detached_client() as (client, listener, server):
        server.should_exit = True
        with pytest.raises(ConnectionClosed):
            await client.recv()
        assert client.close_code == 1012
        await listener.ended.wait()


async def test_rejected_client_gets_the_reason_however_much_it_sends() -> None:
    ended = asyncio.Event()

    async def endpoint(ws: WebSocket) -> None:
        await reject(ws, CloseConnection(4401, "A link is needed", "ask for one"))
        ended.set()

    async with serve_app(endpoint) as (url, _):
        reader, writer = await open_raw(url)
        writer.write(client_frame(Opcode.PING) * 200_000)
        received = await reader.read()
        assert b"A link is needed" in received
        # a Close frame with code 4401
        assert b"\x88" in received
        assert (4401).to_bytes(2, "big") in received
        assert received.count(b"\x8a\x00") == 0
        writer.close()
        await ended.wait()


async def test_handshake_rejected_by_an_http_response_is_no_error_of_the_server(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def endpoint(ws: WebSocket) -> None:
        await ws.send_denial_response(PlainTextResponse("too often", 429))

    async with serve_app(endpoint) as (url, _):
        parts = urlsplit(url)
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        writer.write(upgrade_request(url))
        assert (await reader.read()).startswith(b"HTTP/1.1 429 ")
        writer.close()
    assert [record.getMessage() for record in caplog.records] == []


MALFORMED_LINES = {
    "body": b"Content-Length: 5",
    "coding": b"Transfer-Encoding: chunked",
    "many headers": b"\r\n".join([b"a: b"] * 200),
    "large header": b"a: " + b"b" * 9_000,
    "second key": b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
    "second version": b"Sec-WebSocket-Version: 8",
    "no header": b"abc",
    "NUL": b"a: b\0c",
}


@pytest.mark.parametrize("line", MALFORMED_LINES.values(), ids=MALFORMED_LINES)
async def test_malformed_handshake_is_answered_and_closed(line: bytes) -> None:
    async def endpoint(ws: WebSocket) -> None:
        await ws.accept()
        await ws.close()

    async with serve_app(endpoint) as (url, _):
        parts = urlsplit(url)
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        writer.write(upgrade_request(url)[:-2] + line + b"\r\n\r\n")
        with contextlib.suppress(ConnectionError):
            assert (await reader.read()).startswith((b"HTTP/1.1 400", b"HTTP/1.1 101", b"HTTP/1.1 403"))
        writer.close()


async def test_handshake_that_is_not_answered_is_aborted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(handoff, "HANDSHAKE_TIMEOUT_S", 0.1)
    ended = asyncio.Event()

    async def endpoint(ws: WebSocket) -> None:
        assert (await ws.receive())["type"] == "websocket.connect"
        assert (await ws.receive())["type"] == "websocket.disconnect"
        ended.set()

    async with serve_app(endpoint) as (url, _):
        parts = urlsplit(url)
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        writer.write(upgrade_request(url))
        with contextlib.suppress(ConnectionError):
            assert await reader.read() == b""
        writer.close()
        await ended.wait()


def test_detach_from_another_server_protocol_raises() -> None:
    async def unused() -> None:
        return

    scope = {"type": "websocket", "path": "/", "headers": [], "extensions": {"websocket.http.response": {}}}
    with pytest.raises(RuntimeError, match=r"bunraku\.serve\.uvicorn_protocol_options"):
        detach(WebSocket(scope, unused, unused), RecordingListener())  # type: ignore[arg-type]
