"""A line over real sockets: lost and taken up again, replaced where it falls silent."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress

import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from bunraku.client import reconnecting_connection as lines
from bunraku.client.reconnecting_connection import ReconnectingConnection, StreamEnded
from bunraku.wire.messages import SUBPROTOCOL

Handler = Callable[[ServerConnection, int], Awaitable[None]]


class ConnectionOwner:
    """A line's owner."""

    def __init__(self) -> None:
        self.received: asyncio.Queue[bytes] = asyncio.Queue()
        self.open_count = 0

    def on_open(self) -> None:
        self.open_count += 1


@asynccontextmanager
async def running_connection(
    handler: Handler, silence_timeout: float = 60.0
) -> AsyncIterator[tuple[ReconnectingConnection, ConnectionOwner, asyncio.Task[None]]]:
    """A line to a server whose every connection, told its number, is handled so."""
    count = 0

    async def handle(connection: ServerConnection) -> None:
        nonlocal count
        count += 1
        with suppress(ConnectionError):
            await handler(connection, count)

    async with serve(handle, "127.0.0.1", 0, subprotocols=[SUBPROTOCOL], close_timeout=0.2) as server:  # type: ignore[list-item]
        port = next(iter(server.sockets)).getsockname()[1]
        heard = ConnectionOwner()
        line = ReconnectingConnection(
            lambda: f"ws://127.0.0.1:{port}/", heard.on_open, heard.received.put_nowait, silence_timeout=silence_timeout
        )
        running = asyncio.create_task(line.run())
        try:
            yield line, heard, running
        finally:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "CONNECT_TIMEOUT_S", 0.05)
    monkeypatch.setattr(lines, "RETRY_INTERVAL_S", 0.01)


async def test_one_that_is_lost_is_taken_up_again() -> None:
    async def handle(connection: ServerConnection, number: int) -> None:
        await connection.send(bytes([number]))
        if number < 3:
            await connection.close(1012)
        await connection.wait_closed()

    async with running_connection(handle) as (line, heard, _):
        assert [await heard.received.get() for _ in range(3)] == [b"\1", b"\2", b"\3"]
        assert (heard.open_count, line.reconnects) == (3, 2)


async def send_often(connection: ServerConnection) -> None:
    """Send messages until the connection is closed."""
    with suppress(ConnectionClosed):
        while True:
            await connection.send(b"\2")
            await asyncio.sleep(0.02)


async def test_one_that_falls_silent_is_replaced_by_another_that_is_heard() -> None:
    ended, asked = asyncio.Event(), asyncio.Queue[bytes | str]()

    async def handle(connection: ServerConnection, number: int) -> None:
        # a try that was given up for another, as the machine is busy, is none
        await connection.send(bytes([min(number, 2)]))
        if number == 1:
            await connection.wait_closed()
            ended.set()
        else:
            # it does not fall silent, however long the rest of the test takes
            sending = asyncio.create_task(send_often(connection))
            async for said in connection:
                await asked.put(said)
            sending.cancel()

    async with running_connection(handle, silence_timeout=0.1) as (line, heard, _):
        assert await heard.received.get() == b"\1"
        assert await heard.received.get() == b"\2"
        # nothing is said to the silent one any more
        await ended.wait()
        await line.send(b"here")
        assert await asked.get() == b"here"
        assert (heard.open_count, line.reconnects) == (2, 1)


async def test_a_silent_one_that_is_heard_first_stays_and_what_was_tried_beside_it_is_let_go() -> None:
    tried, gone = asyncio.Event(), asyncio.Event()

    async def handle(connection: ServerConnection, number: int) -> None:
        if number == 1:
            await connection.send(b"first")
            await tried.wait()
            await connection.send(b"still here")
            await gone.wait()
            await connection.send(b"alone")
            await connection.wait_closed()
        else:
            tried.set()
            await connection.wait_closed()
            gone.set()

    async with running_connection(handle, silence_timeout=0.3) as (line, heard, _):
        assert [await heard.received.get() for _ in range(3)] == [b"first", b"still here", b"alone"]
        assert (heard.open_count, line.reconnects) == (1, 0)


async def test_what_is_tried_in_vain_is_given_up_for_another() -> None:
    async def handle(connection: ServerConnection, number: int) -> None:
        if number == 1 or number >= 4:
            await connection.send(bytes([min(number, 4)]))
        await connection.wait_closed()

    async with running_connection(handle, silence_timeout=0.1) as (line, heard, _):
        assert [await heard.received.get() for _ in range(2)] == [b"\1", b"\4"]
        assert line.reconnects == 1


@pytest.mark.parametrize(("code", "told"), [(4404, "no such session"), (1000, r"closed the stream \(1000\)")])
async def test_what_the_server_ends_is_ended_and_says_why(code: int, told: str) -> None:
    async def handle(connection: ServerConnection, _: int) -> None:
        await connection.send(b"hello")
        await connection.close(code, "no such session" if code == 4404 else "")

    async with running_connection(handle) as (line, _, running):
        with pytest.raises(StreamEnded, match=told):
            await running
        await line.send(b"to nobody")


async def test_one_that_never_came_about_is_not_tried_again() -> None:
    line = ReconnectingConnection(lambda: "ws://127.0.0.1:9/", lambda: None, lambda _: None)
    with pytest.raises(OSError):  # noqa: PT011
        await line.run()


async def test_what_its_owner_raises_ends_it() -> None:
    async def handle(connection: ServerConnection, _: int) -> None:
        await connection.send(b"hello")
        await connection.wait_closed()

    async with running_connection(handle) as (line, heard, running):
        line._on_message = lambda _: (_ for _ in ()).throw(StreamEnded("not to be read"))
        with pytest.raises(StreamEnded, match="not to be read"):
            await running
        assert heard.open_count == 1
