"""Viewers that stop reading, that are gone without a close, and that join in a burst."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from bunraku.client import Client, Puppeteer
from bunraku.client.load_generator import LoadGenerator
from bunraku.messaging.bus import MemoryBus
from bunraku.websocket import heartbeat
from bunraku.wire.overlay import Overlay
from tests.raw_client import upgrade_request
from tests.time_limit import HANG_TIMEOUT_S


async def open_session(server: str, clip_file: Path) -> tuple[str, str]:
    """Open a session; return its id and the URL of its stream."""
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        return session, client.socket_url(f"/v1/sessions/{session}/stream")


@asynccontextmanager
async def open_raw_viewer(url: str, receive_buffer_bytes: int | None = None) -> AsyncIterator[socket.socket]:
    """Open a viewer that answers nothing; `receive_buffer_bytes` is its SO_RCVBUF."""
    parts = urlsplit(url)
    loop = asyncio.get_running_loop()
    with socket.socket() as viewer:
        if receive_buffer_bytes is not None:
            viewer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        viewer.setblocking(False)
        await loop.sock_connect(viewer, (parts.hostname, parts.port))
        await loop.sock_sendall(viewer, upgrade_request(url))
        head = b""
        while b"\r\n\r\n" not in head:
            head += await loop.sock_recv(viewer, 1)
        assert b" 101 " in head.split(b"\r\n", 1)[0]
        yield viewer


def split_frames(data: bytes) -> tuple[list[bytes], bytes]:
    """Return the payloads of the complete frames in `data`, and the remaining bytes."""
    payloads, at = [], 0
    while len(data) >= at + 4:
        size, body = (data[at + 1], at + 2) if data[at + 1] < 126 else (int.from_bytes(data[at + 2 : at + 4]), at + 4)
        if body + size > len(data):
            break
        payloads.append(data[body : body + size])
        at = body + size
    return payloads, data[at:]


async def viewer_count(server: str, session: str) -> int:
    async with Client(server) as client:
        return int((await client.session(session))["viewers"])


async def wait_for_viewer_count(server: str, session: str, number: int) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while await viewer_count(server, session) != number:  # noqa: ASYNC110
            await asyncio.sleep(0.05)


async def test_viewer_that_stops_reading_skips_to_the_newest_overlay(
    server: str, clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    buses: list[MemoryBus] = []
    publish = MemoryBus.publish

    def record_bus(self: MemoryBus, subject: str, data: bytes) -> None:
        buses.append(self)
        publish(self, subject, data)

    monkeypatch.setattr(MemoryBus, "publish", record_bus)
    session, url = await open_session(server, clip_file)
    reading_viewers = LoadGenerator(url)
    await reading_viewers.join(3)
    await wait_for_viewer_count(server, session, 3)
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(HANG_TIMEOUT_S), open_raw_viewer(url, 4096) as stalled:
        await wait_for_viewer_count(server, session, 4)
        # overlays of the maximum size, more than a socket buffer holds, at the pace of a session
        frame: dict[int, tuple[int, ...]] = dict.fromkeys(range(4), (7,) * 9)
        sent, last = 2_000, 0
        for number in range(1, sent + 1):
            message = Overlay(number, 1 << 50, frame, (frame,) * 3).pack()
            buses[-1].publish(f"session.{session}.overlay", message)
            if number % 20 == 0:
                await asyncio.sleep(0.001)
        size, data = len(message) + 4, b""
        sequences: list[int] = []
        while last != sent:
            data += await loop.sock_recv(stalled, 1 << 16)
            payloads, data = split_frames(data)
            # a full link receives only the newest frames
            sequences += [Overlay.unpack(payload).sequence for payload in payloads if payload[:1] == b"\x05"]
            last = sequences[-1] if sequences else 0
        # two socket buffers and one message; all overlays would be a megabyte
        assert len(sequences) < sent / 2
        assert len(sequences) * size < 256 << 10
        while len(reading_viewers.state.overlay_lateness) < 3 * sent:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    assert not any(viewer.closed for viewer in reading_viewers.viewers)
    await reading_viewers.close()


async def test_unresponsive_viewer_is_disconnected(
    server: str, clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(heartbeat, "PING_AFTER_US", 200_000)
    monkeypatch.setattr(heartbeat, "HEARTBEAT_TIMEOUT_US", 1_200_000)
    session, url = await open_session(server, clip_file)
    # viewers that answer pings stay connected
    reading_viewers = LoadGenerator(url, single_reporter=True)
    await reading_viewers.join(2)
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(HANG_TIMEOUT_S), open_raw_viewer(url) as silent:
        await wait_for_viewer_count(server, session, 3)
        received = b""
        with contextlib.suppress(ConnectionError):
            while data := await loop.sock_recv(silent, 1 << 16):
                received += data
        assert b"\x89\x00" in received
        await wait_for_viewer_count(server, session, 2)
    assert not any(viewer.closed for viewer in reading_viewers.viewers)
    await reading_viewers.close()


async def test_join_and_leave_burst_does_not_disturb_other_viewers(server: str, clip_file: Path) -> None:
    session, url = await open_session(server, clip_file)
    present, burst = LoadGenerator(url), LoadGenerator(url)
    await present.join(3)
    async with Client(server) as client, Puppeteer(client, session, "one") as puppeteer:
        await puppeteer.claim("left_hand")
        await puppeteer.target("left_hand", 0.45, 0.0, 0.5)
        await burst.join(150, 400)
        await wait_for_viewer_count(server, session, 153)
        statistics = burst.statistics()
        assert (statistics.joined, statistics.refused, statistics.dropped) == (150, 0, 0)
        await burst.close()
        await wait_for_viewer_count(server, session, 3)
        before = len(present.state.overlay_lateness)
        await puppeteer.target("left_hand", 0.45, -0.2, 0.5)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while len(present.state.overlay_lateness) < before + 30:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
    assert not any(viewer.closed for viewer in present.viewers)
    assert present.state.block_lateness
    await present.close()
