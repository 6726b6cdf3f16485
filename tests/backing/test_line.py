from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import AsyncIterator

import pytest

from bunraku.backing.line import Line

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what is on its way")
Ends = tuple[asyncio.Transport, socket.socket]


@pytest.fixture
async def ends() -> AsyncIterator[Ends]:
    """A server's transport, and the client's socket, which has little room and is read by hand."""
    with socket.create_server(("127.0.0.1", 0)) as listening, socket.socket() as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_096)
        client.settimeout(10)
        client.connect(listening.getsockname())
        accepted, _ = listening.accept()
        accepted.setblocking(False)
        transport, _ = await asyncio.get_running_loop().connect_accepted_socket(asyncio.Protocol, accepted)
        yield transport, client
        transport.abort()
        await asyncio.sleep(0)


async def test_what_is_not_acknowledged_is_told(ends: Ends) -> None:
    transport, client = ends
    line = Line(transport)
    before = line.read()
    assert before.waiting == 0
    size = 16 << 20
    transport.write(bytes(size))
    reading = line.read()
    # what the client has room for may be acknowledged, whatever waits in the process counts
    assert size - (1 << 20) < reading.waiting <= size
    left = size
    while left:
        left -= len(await asyncio.to_thread(client.recv, 1 << 20))
    async with asyncio.timeout(10):
        while line.read().waiting:  # noqa: ASYNC110
            await asyncio.sleep(0)
    after = line.read()
    assert 0 < after.least <= after.round_trip < 10_000_000
    assert after.written - before.written == size
    assert before.written < reading.written <= after.written


async def test_a_closed_line_is_an_error_to_read_and_none_to_let_go(ends: Ends) -> None:
    transport, _ = ends
    line = Line(transport)
    transport.abort()
    async with asyncio.timeout(10):
        while transport.get_extra_info("socket").fileno() >= 0:  # noqa: ASYNC110
            await asyncio.sleep(0)
    with pytest.raises(OSError, match="closed"):
        line.read()
    line.hold(False)


async def test_what_is_held_goes_in_one_piece(ends: Ends) -> None:
    transport, client = ends
    line = Line(transport)
    line.hold(True)
    transport.write(b"one ")
    transport.write(b"two")
    line.hold(False)
    assert await asyncio.to_thread(client.recv, 100) == b"one two"
