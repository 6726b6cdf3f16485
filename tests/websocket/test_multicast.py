from __future__ import annotations

import asyncio
import socket
from typing import Any

import pytest

from bunraku.websocket import multicast
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.multicast import MulticastGroup


class SilentListener:
    """A listener that heeds nothing."""

    def on_message(self, message: bytes) -> None: ...

    def on_pong(self, payload: bytes) -> None: ...

    def on_pause(self) -> None: ...

    def on_resume(self) -> None: ...

    def on_close(self) -> None: ...


async def open_connections(
    number: int, receive_buffer_bytes: int | None = None
) -> tuple[list[WebSocketConnection], list[socket.socket]]:
    """Outlets over real sockets, and their other ends."""
    loop = asyncio.get_running_loop()
    mine, theirs = [], []
    for _ in range(number):
        one, other = socket.socketpair()
        if receive_buffer_bytes is not None:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        transport, _ = await loop.create_connection(asyncio.Protocol, sock=one)
        mine.append(WebSocketConnection(transport, SilentListener(), set()))
        other.setblocking(False)
        theirs.append(other)
    return mine, theirs


async def read_bytes(other: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        data += await asyncio.get_running_loop().sock_recv(other, size - len(data))
    return data


@pytest.fixture(params=[True, False], ids=["compiled", "plain"])
def compiled(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    multicast.warm_up()
    assert multicast._compiled_modules, "this system has send(2)"
    if not request.param:
        monkeypatch.setattr(multicast, "_compiled_modules", [])
    return bool(request.param)


@pytest.mark.parametrize("number", [0, 1, 40])
async def test_all_get_the_same(compiled: bool, number: int) -> None:
    mine, theirs = await open_connections(number)
    group = MulticastGroup(mine)
    assert (group._file_descriptors is not None) == (compiled and number == 40)
    group.write(b"one")
    group.write(b"and another")
    async with asyncio.timeout(20):
        assert [await read_bytes(other, 14) for other in theirs] == [b"oneand another"] * number
    for other in theirs:
        other.close()
    for outlet in mine:
        outlet.abort()
    await asyncio.sleep(0)


@pytest.mark.usefixtures("compiled")
async def test_what_has_no_room_comes_later_and_whole() -> None:
    mine, theirs = await open_connections(20, 4096)
    block, wrote = bytes(range(251)) * 4, 0
    stuck = theirs[7]

    async def others() -> None:
        for other in theirs:
            if other is not stuck:
                await read_bytes(other, len(block))

    async with asyncio.timeout(60):
        while mine[7].is_writable:
            MulticastGroup(mine).write(block)
            wrote += 1
            await others()
        assert [outlet.is_writable for outlet in mine].count(False) == 1
        assert await read_bytes(stuck, wrote * len(block)) == block * wrote
    for other in theirs:
        other.close()
    for outlet in mine:
        outlet.abort()
    await asyncio.sleep(0)


@pytest.mark.usefixtures("compiled")
async def test_one_that_is_broken_ends_and_the_others_go_on() -> None:
    mine, theirs = await open_connections(20)
    ended = asyncio.Event()

    class Told(SilentListener):
        def gone(self) -> None:
            ended.set()

    mine[3]._listener = Told()
    theirs[3].close()
    MulticastGroup(mine).write(b"to all")
    async with asyncio.timeout(20):
        for place, other in enumerate(theirs):
            if place != 3:
                assert await read_bytes(other, 6) == b"to all"
        await ended.wait()
    for other in theirs:
        other.close()
    for outlet in mine:
        outlet.abort()
    await asyncio.sleep(0)


@pytest.mark.usefixtures("compiled")
async def test_what_is_encrypted_is_not_written_to_the_socket() -> None:
    mine, theirs = await open_connections(12)

    class Secret(asyncio.Transport):
        """Says that it is encrypted, as asyncio's transports over TLS do."""

        def __init__(self) -> None:
            super().__init__()
            self.written: list[bytes] = []

        def get_extra_info(self, name: str, default: Any = None) -> Any:
            return theirs[0] if name == "socket" else (object() if name == "sslcontext" else default)

        def set_protocol(self, protocol: asyncio.BaseProtocol) -> None: ...

        def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...

        def write(self, data: Any) -> None:
            self.written.append(bytes(data))

    secret = Secret()
    MulticastGroup([*mine, WebSocketConnection(secret, SilentListener(), set())]).write(b"hidden")
    assert secret.written == [b"hidden"]
    for other in theirs:
        other.close()
    for outlet in mine:
        outlet.abort()
    await asyncio.sleep(0)
