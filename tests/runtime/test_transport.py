from __future__ import annotations

import asyncio
import contextlib
import socket

import pytest

from bunraku.runtime import transport
from bunraku.runtime.transport import LingeringClose, WriteDeadline, set_receive_buffer, unsent_bytes
from tests.time_limit import HANG_TIMEOUT_S


class Sender(asyncio.Protocol):
    """Protocol that writes much at once, under a write deadline."""

    def __init__(self) -> None:
        self.ended = asyncio.Event()

    def connection_made(self, connected: asyncio.BaseTransport) -> None:
        assert isinstance(connected, asyncio.Transport)
        self.transport = connected
        connected.set_write_buffer_limits(0, 0)
        self.deadline = WriteDeadline(connected)
        connected.write(bytes(16 << 20))

    def pause_writing(self) -> None:
        self.deadline.start()

    def resume_writing(self) -> None:
        self.deadline.stop()
        self.transport.write(b"end")

    def connection_lost(self, _: Exception | None) -> None:
        self.deadline.stop()
        self.ended.set()


async def connect_to(sender: asyncio.Protocol) -> socket.socket:
    """Return a client's socket, connected to a server with this protocol."""
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: sender, "127.0.0.1", 0)
    client = socket.socket()
    client.setblocking(False)
    await loop.sock_connect(client, server.sockets[0].getsockname())
    server.close()
    return client


async def test_client_that_never_reads_is_aborted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "WRITE_WINDOW_S", 0.05)
    sender = Sender()
    with contextlib.closing(await connect_to(sender)):
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await sender.ended.wait()


async def test_client_that_reads_gets_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    # each window is long enough for a client that reads all the time
    monkeypatch.setattr(transport, "WRITE_WINDOW_S", 5.0)
    loop, sender, received = asyncio.get_running_loop(), Sender(), 0
    with contextlib.closing(await connect_to(sender)) as client:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while received < (16 << 20) + 3:
                received += len(await loop.sock_recv(client, 1 << 20))
        assert unsent_bytes(sender.transport) >= 0
        assert not sender.ended.is_set()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await sender.ended.wait()


class Rejecter(asyncio.Protocol):
    """Protocol that rejects its client at the first data."""

    def __init__(self) -> None:
        self.ended = asyncio.Event()

    def connection_made(self, connected: asyncio.BaseTransport) -> None:
        assert isinstance(connected, asyncio.Transport)
        self.transport = connected

    def data_received(self, _: bytes) -> None:
        self.transport.write(b"no")
        LingeringClose(self.transport, lambda _: self.ended.set())


async def test_rejected_client_reads_the_reason_while_it_sends() -> None:
    loop, rejecter = asyncio.get_running_loop(), Rejecter()
    with contextlib.closing(await connect_to(rejecter)) as client:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await loop.sock_sendall(client, bytes(100_000))
            assert await loop.sock_recv(client, 100) == b"no"
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await rejecter.ended.wait()


async def test_rejected_client_that_stays_is_aborted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transport, "LINGER_S", 0.05)
    loop, rejecter = asyncio.get_running_loop(), Rejecter()
    with contextlib.closing(await connect_to(rejecter)) as client:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await loop.sock_sendall(client, b"hello")
            await rejecter.ended.wait()


class Reader(asyncio.Protocol):
    """Protocol with a small receive buffer that reads once, after it was told to."""

    def __init__(self) -> None:
        self.received: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self.connected = asyncio.Event()

    def connection_made(self, connected: asyncio.BaseTransport) -> None:
        assert isinstance(connected, asyncio.Transport)
        self.transport = connected
        set_receive_buffer(connected, 16 << 10)
        connected.pause_reading()
        self.connected.set()

    def data_received(self, data: bytes) -> None:
        self.transport.abort()
        self.received.set_result(len(data))


async def test_no_more_than_the_receive_buffer_arrives_at_once() -> None:
    reader = Reader()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with await connect_to(reader) as client:
            await reader.connected.wait()
            with contextlib.suppress(BlockingIOError):
                while True:
                    client.send(bytes(64 << 10))
            reader.transport.resume_reading()
            assert await reader.received <= 64 << 10
