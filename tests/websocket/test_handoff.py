from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest
import uvicorn
from starlette.applications import Starlette
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.handoff import HandoffProtocol, detach
from bunraku.websocket.subprotocol import CloseConnection


class RecordingListener:
    """A listener that keeps what it is told."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self.events: list[str] = []
        self.connection: WebSocketConnection
        self.ended = asyncio.Event()
        self.resumed = asyncio.Event()

    def on_message(self, message: bytes) -> None:
        if message == b"refuse me":
            raise CloseConnection(4404, "Nothing", "here")
        self.messages.append(message)
        self.connection.write(encode_frame(b"heard " + message))

    def on_pong(self, payload: bytes) -> None: ...

    def on_pause(self) -> None:
        self.events.append("pause")

    def on_resume(self) -> None:
        self.events.append("resume")
        self.resumed.set()

    def on_close(self) -> None:
        self.events.append("gone")
        self.ended.set()


@asynccontextmanager
async def serve_app(endpoint: Callable[[WebSocket], Awaitable[None]]) -> AsyncIterator[tuple[str, uvicorn.Server]]:
    app = Starlette(routes=[WebSocketRoute("/", endpoint)])
    config = uvicorn.Config(
        app, ws=HandoffProtocol, lifespan="off", log_config=None, log_level="warning", ws_per_message_deflate=False
    )
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        serving = asyncio.create_task(server.serve(sockets=[listening]))
        async with asyncio.timeout(30):
            yield f"ws://127.0.0.1:{listening.getsockname()[1]}/", server
            server.should_exit = True
            await serving


@asynccontextmanager
async def detached_client() -> AsyncIterator[tuple[ClientConnection, RecordingListener, uvicorn.Server]]:
    """A client of a socket that was taken, who hears what comes, and the server."""
    heard = RecordingListener()

    async def talk(ws: WebSocket) -> None:
        await ws.accept()
        heard.connection = detach(ws, heard)
        heard.connection.write(encode_frame(b"hello"))

    async with serve_app(talk) as (url, server), connect(url, compression=None, max_size=1 << 21) as client:
        assert await client.recv() == b"hello"
        yield client, heard, server


async def test_what_is_taken_speaks_both_ways_and_ends_as_it_should() -> None:
    async with detached_client() as (client, heard, _):
        await client.send(b"one")
        await client.send([b"t", b"w", b"o"])
        assert [await client.recv(), await client.recv()] == [b"heard one", b"heard two"]
        await (await client.ping())
        before = heard.connection.last_received_at
        heard.connection.send_ping()
        await (await client.ping())
        assert heard.connection.last_received_at >= before
        await client.close(1001, "enough")
        await heard.ended.wait()
        assert client.close_code == 1001
        assert heard.events[-1] == "gone"
        assert heard.events.count("gone") == 1


@pytest.mark.parametrize(
    ("sends", "code", "title"),
    [(b"refuse me", 4404, b"Nothing"), ("text", 1008, b"Text"), (bytes(1025), 1009, b"Too large")],
)
async def test_a_refusal_is_said_and_closes(sends: bytes | str, code: int, title: bytes) -> None:
    async with detached_client() as (client, heard, _):
        await client.send(sends)
        said = b""
        with pytest.raises(ConnectionClosed):  # noqa: PT012
            while True:
                said += bytes(await client.recv())  # type: ignore[arg-type]
        assert title in said
        assert client.close_code == code
        await heard.ended.wait()


async def test_who_does_not_read_pauses_the_outlet_and_resumes_it() -> None:
    async with detached_client() as (client, heard, _):
        block = encode_frame(bytes(1 << 18))
        count = 0
        while heard.connection.is_writable:
            heard.connection.write(block)
            count += 1
            await asyncio.sleep(0)
        assert heard.connection.buffered_bytes > 0
        for _ in range(count):
            assert await client.recv() == bytes(1 << 18)
        await heard.resumed.wait()
        assert heard.events == ["pause", "resume"]
        assert heard.connection.buffered_bytes == 0


async def test_one_that_is_gone_is_aborted() -> None:
    async with detached_client() as (client, heard, _):
        heard.connection.abort()
        await heard.ended.wait()
        with pytest.raises(ConnectionClosed):
            await client.recv()


async def test_the_servers_end_closes_what_was_taken() -> None:
    async with detached_client() as (client, heard, server):
        server.should_exit = True
        with pytest.raises(ConnectionClosed):
            await client.recv()
        assert client.close_code == 1012
        await heard.ended.wait()


async def test_other_sockets_are_served_the_usual_way() -> None:
    async def talk(ws: WebSocket) -> None:
        await ws.accept()
        await ws.send_bytes(await ws.receive_bytes())
        await ws.close()

    async with serve_app(talk) as (url, _), connect(url, compression=None) as client:
        await client.send(b"there and back")
        assert await client.recv() == b"there and back"


def test_another_server_is_said_to_be_the_wrong_one() -> None:
    async def nothing() -> None:
        return

    scope = {"type": "websocket", "path": "/", "headers": [], "extensions": {"websocket.http.response": {}}}
    with pytest.raises(RuntimeError, match=r"bunraku\.serve\.protocol"):
        detach(WebSocket(scope, nothing, nothing), RecordingListener())  # type: ignore[arg-type]
