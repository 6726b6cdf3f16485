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
from tests.time_limit import HANG_TIMEOUT_S

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="the state of TCP connections is available on Linux only"
)
TransportPair = tuple[asyncio.Transport, socket.socket]


@pytest.fixture
async def pair() -> AsyncIterator[TransportPair]:
    """Transport of a server, and the blocking socket of its client, which has a small receive buffer."""
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


async def test_sample_counts_unacknowledged_bytes(pair: TransportPair) -> None:
    transport, client = pair
    link = TcpLink(transport)
    before = link.sample()
    assert before.unacked_bytes == 0
    size = 16 << 20
    transport.write(bytes(size))
    during = link.sample()
    # the client's kernel may have acknowledged some bytes; those buffered in the process are counted
    assert size - (1 << 20) < during.unacked_bytes <= size
    remaining = size
    while remaining:
        remaining -= len(await asyncio.to_thread(client.recv, 1 << 20))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while link.sample().unacked_bytes:  # noqa: ASYNC110
            await asyncio.sleep(0)
    after = link.sample()
    assert 0 < after.min_rtt_us <= after.rtt_us < 10_000_000
    assert after.written_bytes - before.written_bytes == size
    assert before.written_bytes < during.written_bytes <= after.written_bytes


async def test_closed_socket_raises_on_sample_but_not_on_options(pair: TransportPair) -> None:
    transport, _ = pair
    link = TcpLink(transport)
    transport.abort()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while transport.get_extra_info("socket").fileno() >= 0:  # noqa: ASYNC110
            await asyncio.sleep(0)
    with pytest.raises(OSError, match="closed"):
        link.sample()
    link.set_corked(False)
    link.use_loss_based_congestion()


async def test_loss_based_congestion_selects_reno(pair: TransportPair) -> None:
    transport, _ = pair
    TcpLink(transport).use_loss_based_congestion()
    chosen = transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_CONGESTION, 16)
    assert chosen.rstrip(b"\0") == b"reno"


async def test_corked_writes_arrive_in_one_packet(pair: TransportPair) -> None:
    transport, client = pair
    link = TcpLink(transport)
    link.set_corked(True)
    transport.write(b"one ")
    transport.write(b"two")
    link.set_corked(False)
    assert await asyncio.to_thread(client.recv, 100) == b"one two"


def pong_payloads(pings: bytes) -> list[bytes]:
    """Return the payloads with which a client answers the Pings in written bytes."""
    return [payload for opcode, payload in parse_frames(pings) if opcode == Opcode.PING]


def test_acked_link_counts_echoed_bytes_as_received() -> None:
    now = [10**9]
    link = AckedLink(lambda: now[0])
    assert link.sample() == (0, UNKNOWN_RTT_US, 0, 0)
    first, second = pong_payloads(link.probe(500)), pong_payloads(link.probe(90))
    assert link.sample().unacked_bytes == 590
    now[0] += 180_000
    link.receive_probe_echo(first[0])
    assert link.sample() == (90, 180_000, 180_000, 0)
    # a late Pong raises the round-trip time before it arrives
    now[0] += 400_000
    assert link.sample().rtt_us == 580_000
    link.receive_probe_echo(second[0])
    assert link.sample() == (0, 580_000, 180_000, 0)
    # Pongs that answer no Ping are ignored
    for payload in (second[0], b"", b"\xff\xff\xff\xff", b"unexpected payload"):
        link.receive_probe_echo(payload)
    assert link.sample() == (0, 580_000, 180_000, 0)


def test_acked_link_pong_acknowledges_all_earlier_pings() -> None:
    now = [10**9]
    link = AckedLink(lambda: now[0])
    pings = b"".join(link.probe(size) for size in (10, 20, 30))
    assert link.probe(0) == b""
    now[0] += 5_000
    link.receive_probe_echo(pong_payloads(pings)[1])
    assert link.sample().unacked_bytes == 30
    link.receive_probe_echo(pong_payloads(pings)[2])
    assert link.sample().unacked_bytes == 0
    assert len(pong_payloads(link.probe(0))) == 1
    assert link.probe(0) == b""


@pytest.mark.parametrize("header", ["x-forwarded-for", "forwarded", "via"])
async def test_proxy_header_selects_the_acked_link(pair: TransportPair, header: str) -> None:
    transport, _ = pair

    def link_for(headers: list[tuple[bytes, bytes]]) -> object:
        scope = {"type": "websocket", "headers": headers, "extensions": {LINK_EXTENSION: {"transport": transport}}}
        return link_of(WebSocket(scope, None, None))  # type: ignore[arg-type]

    assert isinstance(link_for([(b"host", b"stage")]), TcpLink)
    assert isinstance(link_for([(header.encode(), b"192.0.2.1")]), AckedLink)
