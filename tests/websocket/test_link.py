from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import AsyncIterator

import pytest
from starlette.websockets import WebSocket

from bunraku.websocket.frame import Opcode
from bunraku.websocket.link import LINK_EXTENSION, UNKNOWN_RTT_US, AckedLink, TcpLink, link_of
from tests.stream.fake_transport import parse_frames

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what is on its way")
TransportPair = tuple[asyncio.Transport, socket.socket]


@pytest.fixture
async def ends() -> AsyncIterator[TransportPair]:
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


async def test_what_is_not_acknowledged_is_told(ends: TransportPair) -> None:
    transport, client = ends
    line = TcpLink(transport)
    before = line.sample()
    assert before.unacked_bytes == 0
    size = 16 << 20
    transport.write(bytes(size))
    reading = line.sample()
    # what the client has room for may be acknowledged, whatever waits in the process counts
    assert size - (1 << 20) < reading.unacked_bytes <= size
    left = size
    while left:
        left -= len(await asyncio.to_thread(client.recv, 1 << 20))
    async with asyncio.timeout(10):
        while line.sample().unacked_bytes:  # noqa: ASYNC110
            await asyncio.sleep(0)
    after = line.sample()
    assert 0 < after.min_rtt_us <= after.rtt_us < 10_000_000
    assert after.written_bytes - before.written_bytes == size
    assert before.written_bytes < reading.written_bytes <= after.written_bytes


async def test_a_closed_line_is_an_error_to_read_and_none_to_let_go(ends: TransportPair) -> None:
    transport, _ = ends
    line = TcpLink(transport)
    transport.abort()
    async with asyncio.timeout(10):
        while transport.get_extra_info("socket").fileno() >= 0:  # noqa: ASYNC110
            await asyncio.sleep(0)
    with pytest.raises(OSError, match="closed"):
        line.sample()
    line.set_corked(False)
    line.use_loss_based_congestion()


async def test_a_plain_line_is_held_back_by_loss_alone(ends: TransportPair) -> None:
    transport, _ = ends
    TcpLink(transport).use_loss_based_congestion()
    chosen = transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_CONGESTION, 16)
    assert chosen.rstrip(b"\0") == b"reno"


async def test_what_is_held_goes_in_one_piece(ends: TransportPair) -> None:
    transport, client = ends
    line = TcpLink(transport)
    line.set_corked(True)
    transport.write(b"one ")
    transport.write(b"two")
    line.set_corked(False)
    assert await asyncio.to_thread(client.recv, 100) == b"one two"


def pong_payloads(asked: bytes) -> list[bytes]:
    """What a client answers to the Pings in what was written."""
    return [payload for opcode, payload in parse_frames(asked) if opcode == Opcode.PING]


def test_behind_a_proxy_what_was_echoed_has_come() -> None:
    now = [10**9]
    line = AckedLink(lambda: now[0])
    assert line.sample() == (0, UNKNOWN_RTT_US, 0, 0)
    first, second = pong_payloads(line.probe(500)), pong_payloads(line.probe(90))
    assert line.sample().unacked_bytes == 590
    now[0] += 180_000
    line.receive_probe_echo(first[0])
    assert line.sample() == (90, 180_000, 180_000, 0)
    # one that is late is known to be before it comes
    now[0] += 400_000
    assert line.sample().rtt_us == 580_000
    line.receive_probe_echo(second[0])
    assert line.sample() == (0, 580_000, 180_000, 0)
    # answers to nothing say nothing
    for payload in (second[0], b"", b"\xff\xff\xff\xff", b"more than it was asked"):
        line.receive_probe_echo(payload)
    assert line.sample() == (0, 580_000, 180_000, 0)


def test_behind_a_proxy_an_answer_stands_for_those_before_it_and_one_ping_alone_is_on_its_way() -> None:
    now = [10**9]
    line = AckedLink(lambda: now[0])
    asked = b"".join(line.probe(size) for size in (10, 20, 30))
    assert line.probe(0) == b""
    now[0] += 5_000
    line.receive_probe_echo(pong_payloads(asked)[1])
    assert line.sample().unacked_bytes == 30
    line.receive_probe_echo(pong_payloads(asked)[2])
    assert line.sample().unacked_bytes == 0
    assert len(pong_payloads(line.probe(0))) == 1
    assert line.probe(0) == b""


@pytest.mark.parametrize("head", ["x-forwarded-for", "forwarded", "via"])
async def test_a_viewer_behind_a_proxy_is_known_by_what_the_proxy_says(ends: TransportPair, head: str) -> None:
    transport, _ = ends

    def come(headers: list[tuple[bytes, bytes]]) -> object:
        scope = {"type": "websocket", "headers": headers, "extensions": {LINK_EXTENSION: {"transport": transport}}}
        return link_of(WebSocket(scope, None, None))  # type: ignore[arg-type]

    assert isinstance(come([(b"host", b"stage")]), TcpLink)
    assert isinstance(come([(head.encode(), b"192.0.2.1")]), AckedLink)
