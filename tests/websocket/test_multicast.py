from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import pytest

from bunraku.kernels import load_kernels
from bunraku.websocket import multicast
from bunraku.websocket.connection import BinaryListener, WebSocketConnection
from bunraku.websocket.multicast import (
    MAX_PLAIN_GROUP,
    PLAIN_SENDER,
    CompiledSender,
    LazySender,
    MulticastGroup,
    MulticastSender,
)
from tests.time_limit import HANG_TIMEOUT_S


class SilentListener(BinaryListener):
    """Listener that ignores all events."""

    def on_message(self, message: bytes) -> None: ...

    def on_pong(self, _: bytes) -> bool:
        return False

    def on_pause(self) -> None: ...

    def on_resume(self) -> None: ...

    def on_close(self) -> None: ...


async def open_connections(
    number: int, receive_buffer_bytes: int | None = None
) -> tuple[list[WebSocketConnection], list[socket.socket]]:
    """Return connections over real sockets, and the sockets of their clients."""
    loop = asyncio.get_running_loop()
    connections, clients = [], []
    for _ in range(number):
        server_side, client_side = socket.socketpair()
        if receive_buffer_bytes is not None:
            client_side.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        transport, _ = await loop.create_connection(asyncio.Protocol, sock=server_side)
        connections.append(WebSocketConnection(transport, SilentListener(), set()))
        client_side.setblocking(False)
        clients.append(client_side)
    return connections, clients


async def close_all(connections: Sequence[WebSocketConnection], clients: Sequence[socket.socket]) -> None:
    for client in clients:
        client.close()
    for connection in connections:
        connection.abort()
    await asyncio.sleep(0)


async def read_bytes(client: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        data += await asyncio.get_running_loop().sock_recv(client, size - len(data))
    return data


@pytest.fixture(params=["compiled", "plain"])
def sender(request: pytest.FixtureRequest) -> MulticastSender:
    return CompiledSender(load_kernels("websocket")) if request.param == "compiled" else PLAIN_SENDER


@pytest.mark.parametrize("number", [0, 1, 40])
async def test_all_connections_receive_the_same_bytes(sender: MulticastSender, number: int) -> None:
    connections, clients = await open_connections(number)
    group = MulticastGroup(connections, sender)
    assert len(group) == number
    # bytes that were sent without a transport
    is_compiled = sender is not PLAIN_SENDER and number > MAX_PLAIN_GROUP
    assert group.write(b"one") == (3 * number if is_compiled else 0)
    group.write(b"and another")
    async with asyncio.timeout(HANG_TIMEOUT_S):
        assert [await read_bytes(client, 14) for client in clients] == [b"oneand another"] * number
    await close_all(connections, clients)


async def test_bytes_that_a_socket_does_not_accept_are_sent_later(sender: MulticastSender) -> None:
    connections, clients = await open_connections(20, 4096)
    block, block_count = bytes(range(251)) * 4, 0
    blocked = clients[7]

    async def read_others() -> None:
        for client in clients:
            if client is not blocked:
                await read_bytes(client, len(block))

    async with asyncio.timeout(HANG_TIMEOUT_S):
        while connections[7].is_writable:
            MulticastGroup(connections, sender).write(block)
            block_count += 1
            await read_others()
        assert [connection.is_writable for connection in connections].count(False) == 1
        assert await read_bytes(blocked, block_count * len(block)) == block * block_count
    await close_all(connections, clients)


async def test_broken_connection_ends_and_the_others_receive(sender: MulticastSender) -> None:
    connections, clients = await open_connections(20)
    ended = asyncio.Event()

    class CloseListener(SilentListener):
        def on_close(self) -> None:
            ended.set()

    connections[3]._listener = CloseListener()
    clients[3].close()
    MulticastGroup(connections, sender).write(b"to all")
    async with asyncio.timeout(HANG_TIMEOUT_S):
        for index, client in enumerate(clients):
            if index != 3:
                assert await read_bytes(client, 6) == b"to all"
        await ended.wait()
    await close_all(connections, clients)


async def test_encrypted_connection_is_written_through_its_transport(sender: MulticastSender) -> None:
    connections, clients = await open_connections(12)

    class TlsTransport(asyncio.Transport):
        """Transport with an SSL context, like those of asyncio for TLS."""

        def __init__(self) -> None:
            super().__init__()
            self.written: list[bytes] = []

        def get_extra_info(self, name: str, default: Any = None) -> Any:
            return clients[0] if name == "socket" else (object() if name == "sslcontext" else default)

        def set_protocol(self, protocol: asyncio.BaseProtocol) -> None: ...

        def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...

        def write(self, data: Any) -> None:
            self.written.append(bytes(data))

    transport = TlsTransport()
    encrypted = WebSocketConnection(transport, SilentListener(), set())
    MulticastGroup([*connections, encrypted], sender).write(b"hidden")
    assert transport.written == [b"hidden"]
    await close_all(connections, clients)


async def test_lazy_sender_is_plain_until_loaded() -> None:
    connections, clients = await open_connections(MAX_PLAIN_GROUP + 1)
    lazy = LazySender()
    assert MulticastGroup(connections, lazy).write(b"plain") == 0
    lazy.load()
    assert MulticastGroup(connections, lazy).write(b"compiled") == 8 * len(connections)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        assert [await read_bytes(client, 13) for client in clients] == [b"plaincompiled"] * len(clients)
    await close_all(connections, clients)


@pytest.mark.parametrize("error", [ImportError, AttributeError])
async def test_lazy_sender_stays_plain_without_posix_sockets(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    def fail(_: str) -> ModuleType:
        raise error

    load: Callable[[str], ModuleType] = fail
    monkeypatch.setattr(multicast, "load_kernels", load)
    connections, clients = await open_connections(MAX_PLAIN_GROUP + 1)
    lazy = LazySender()
    lazy.load()
    assert MulticastGroup(connections, lazy).write(b"plain") == 0
    await close_all(connections, clients)
