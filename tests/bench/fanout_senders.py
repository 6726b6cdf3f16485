"""Servers that `make bench-fanout` compares: each sends the same bytes to every client at a fixed rate.

`python -m tests.bench.fanout_senders KIND BYTES HERTZ`: prints the port at which it listens, then for each line of
standard input, a number of seconds, sends for that time and prints one JSON object: `messages` sent and `cpu`, the user
and system time of this process in seconds. KIND is `bunraku` (the stream service as `bunraku up` serves it, an overlay
published on its bus), `playing` (the same with a playing motion), `fastapi` (`send_bytes` in a loop), `websockets`
(`broadcast`) or `socketio` (`emit`). With the first two, `waiting` instead of a number requests the maximum number of
bytes queued for a viewer.
"""

from __future__ import annotations

import asyncio
import fcntl
import json
import resource
import socket
import struct
import sys
import tempfile
import termios
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import msgpack
import uvicorn
import uvloop
from fastapi import FastAPI, WebSocket, WebSocketDisconnect

from bunraku.codec.container import pack_motion
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.websocket.connection import WebSocketConnection
from bunraku.wire.messages import Presence
from bunraku.wire.overlay import Overlay

SESSION = "bench"
MOTION_DURATION_US = 90_000_000
SendMessage = Callable[[bytes], Awaitable[int]]
"""Sends to every client and returns the number of clients."""


def processor_seconds() -> float:
    """Return the user and system time of this process, seconds."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


async def run_sender(
    listening: socket.socket, send: SendMessage, size: int, hertz: int, queued_bytes: Callable[[], int] = lambda: 0
) -> None:
    """Execute the commands of standard input until it ends."""
    print(listening.getsockname()[1], flush=True)
    number = 0
    while line := await asyncio.to_thread(sys.stdin.readline):
        if line.strip() == "waiting":
            print(json.dumps({"most": queued_bytes(), "number": number}), flush=True)
            continue
        messages, before, begun = 0, processor_seconds(), time.monotonic()
        for tick in range(round(float(line) * hertz)):
            await asyncio.sleep(max(begun + tick / hertz - time.monotonic(), 0.0))
            number += 1
            messages += await send(make_overlay(number, size))
        print(json.dumps({"messages": messages, "cpu": round(processor_seconds() - before, 6)}), flush=True)


def make_overlay(number: int, size: int) -> bytes:
    """Make an overlay of `size` bytes, 12 plus a multiple of 18; zeros for other sizes."""
    limbs, frames = next(((n, f) for n in (1, 2, 3, 4) for f in (1, 2, 3) if 12 + 18 * n * f == size), (0, 0))
    limb_values: dict[int, tuple[int, ...]] = dict.fromkeys(range(limbs), (number & 0xFF,) * 9)
    return (
        Overlay(number, clock() + 60_000, limb_values, (limb_values,) * (frames - 1)).pack() if limbs else bytes(size)
    )


async def start_server(app: Any, listening: socket.socket, **options: Any) -> uvicorn.Server:
    """Start a uvicorn server with its defaults; return when it listens."""
    server = uvicorn.Server(uvicorn.Config(app, log_level="warning", access_log=False, **options))
    _tasks.append(asyncio.create_task(server.serve(sockets=[listening])))
    while not server.started:  # noqa: ASYNC110 - uvicorn has no event for it
        await asyncio.sleep(0.01)
    return server


_tasks: list[asyncio.Task[None]] = []


def max_queued_bytes(server: uvicorn.Server) -> int:
    """Return the maximum number of bytes queued for a viewer: in the process, and in the kernel (SIOCOUTQ)."""
    max_bytes = 0
    for connection in server.server_state.connections:
        if isinstance(connection, WebSocketConnection):
            plain_socket = connection._transport.get_extra_info("socket")
            kernel_bytes = struct.unpack("=i", fcntl.ioctl(plain_socket.fileno(), termios.TIOCOUTQ, bytes(4)))[0]
            max_bytes = max(max_bytes, connection.buffered_bytes + kernel_bytes)
    return max_bytes


async def run_bunraku(listening: socket.socket, size: int, hertz: int, *, playing: bool = False) -> None:
    import bunraku.stream.app
    from bunraku.codec.motion_encoder import encode_motion
    from bunraku.serve import uvicorn_protocol_options
    from tests.vectors.blocks import random_motion

    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        async with open_context(Settings(data=Path(folder))) as context:
            encoded = encode_motion(
                random_motion(MOTION_DURATION_US / 1e6, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live"
            )
            await context.motion_store.put(SESSION, pack_motion(SESSION, encoded))
            state = timeline.start(SESSION, MOTION_DURATION_US, clock())
            # on a paused timeline only overlays are sent
            state = timeline.edit(state, clock(), playing=playing)
            viewers: dict[str, int] = {}

            async def report_state(_: bytes) -> bytes:
                packed: bytes = msgpack.packb([state.pack(), Presence(0, [], [None] * 4).pack(), None])
                return packed

            context.bus.serve(f"session.{SESSION}.state", report_state)
            context.bus.subscribe(f"session.{SESSION}.viewers", lambda data: viewers.update([msgpack.unpackb(data)]))

            async def send(data: bytes) -> int:
                context.bus.publish(f"session.{SESSION}.overlay", data)
                return sum(viewers.values())

            app = bunraku.stream.app.create_app(context)
            await asyncio.to_thread(app.state.multicast_sender.load)
            server = await start_server(app, listening, lifespan="off", **uvicorn_protocol_options())
            await run_sender(listening, send, size, hertz, lambda: max_queued_bytes(server))


async def run_bunraku_playing(listening: socket.socket, size: int, hertz: int) -> None:
    await run_bunraku(listening, size, hertz, playing=True)


async def run_fastapi(listening: socket.socket, size: int, hertz: int) -> None:
    app = FastAPI()
    sockets: set[WebSocket] = set()

    @app.websocket("/")
    async def watch(websocket: WebSocket) -> None:
        await websocket.accept()
        sockets.add(websocket)
        try:
            while True:
                await websocket.receive_bytes()
        except WebSocketDisconnect:
            sockets.discard(websocket)

    async def send(data: bytes) -> int:
        for connection in tuple(sockets):
            await connection.send_bytes(data)
        return len(sockets)

    await start_server(app, listening)
    await run_sender(listening, send, size, hertz)


async def run_websockets(listening: socket.socket, size: int, hertz: int) -> None:
    from websockets.asyncio.server import ServerConnection, broadcast, serve

    async def watch(connection: ServerConnection) -> None:
        await connection.wait_closed()

    async with serve(watch, sock=listening) as server:

        async def send(data: bytes) -> int:
            broadcast(server.connections, data)
            return len(server.connections)

        await run_sender(listening, send, size, hertz)


async def run_socketio(listening: socket.socket, size: int, hertz: int) -> None:
    import socketio

    server = socketio.AsyncServer(async_mode="asgi", ping_interval=3600)
    clients: set[str] = set()
    server.on("connect", lambda sid, _: clients.add(sid))
    server.on("disconnect", lambda sid, _: clients.discard(sid))

    async def send(data: bytes) -> int:
        await server.emit("overlay", data)
        return len(clients)

    await start_server(socketio.ASGIApp(server), listening)
    await run_sender(listening, send, size, hertz)


SENDERS = {
    "bunraku": run_bunraku,
    "playing": run_bunraku_playing,
    "fastapi": run_fastapi,
    "websockets": run_websockets,
    "socketio": run_socketio,
}


def main() -> None:
    kind, size, hertz = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    with socket.create_server(("127.0.0.1", 0), backlog=1024) as listening:
        uvloop.run(SENDERS[kind](listening, size, hertz))


if __name__ == "__main__":
    main()
