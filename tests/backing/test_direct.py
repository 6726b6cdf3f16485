from __future__ import annotations

import asyncio
import socket

import pytest
import uvicorn
from starlette.applications import Starlette
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket
from websockets.asyncio.client import connect
from websockets.frames import Frame, Opcode

from bunraku.backing.direct import DirectProtocol, frame, writer


@pytest.mark.parametrize("size", [0, 1, 125, 126, 65_535, 65_536, 70_000])
def test_a_frame_is_what_the_standard_says(size: int) -> None:
    message = bytes(index & 0xFF for index in range(size))
    assert frame(message) == Frame(Opcode.BINARY, message).serialize(mask=False)


async def test_frames_written_past_the_queue_come_between_the_others_whole() -> None:
    outcomes: list[bool] = []

    async def talk(ws: WebSocket) -> None:
        write = writer(ws)
        assert write is not None
        outcomes.append(write(frame(b"too early")))
        await ws.accept()
        await ws.send_bytes(b"one")
        outcomes.append(write(frame(b"two")))
        await ws.send_bytes(b"three")
        # a client that does not read: what does not fit is not taken
        large = frame(bytes(1 << 20))
        outcomes.extend(write(large) for _ in range(64))
        await ws.receive()
        await ws.close()
        outcomes.append(write(frame(b"too late")))

    app = Starlette(routes=[WebSocketRoute("/", talk)])
    config = uvicorn.Config(app, ws=DirectProtocol, lifespan="off", log_level="warning", ws_per_message_deflate=False)
    server = uvicorn.Server(config)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        serving = asyncio.create_task(server.serve(sockets=[listening]))
        url = f"ws://127.0.0.1:{listening.getsockname()[1]}/"
        async with asyncio.timeout(20):
            async with connect(url, compression=None, max_size=1 << 21) as client:
                received = [await client.recv() for _ in range(3)]
                assert received == [b"one", b"two", b"three"]
                await client.send(b"go on")
                count = 0
                async for data in client:
                    assert data == bytes(1 << 20)
                    count += 1
            server.should_exit = True
            await serving
    assert outcomes[:2] == [False, True]
    assert not outcomes[-1]
    taken = outcomes[2:-1]
    assert count == sum(taken)
    assert False in taken


def test_a_server_without_it_is_served_the_usual_way() -> None:
    async def nothing() -> None:
        return

    scope = {"type": "websocket", "path": "/", "headers": [], "extensions": {"websocket.http.response": {}}}
    assert writer(WebSocket(scope, nothing, nothing)) is None  # type: ignore[arg-type]
