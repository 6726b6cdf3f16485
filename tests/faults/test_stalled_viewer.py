"""Viewers that stop reading, that are no longer there, and that come all at once."""

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
from bunraku.stream import heartbeat
from bunraku.wire.overlay import Overlay
from tests.raw_client import upgrade_request


async def open_session(server: str, clip_file: Path) -> tuple[str, str]:
    """A session's id, and the address of its stream."""
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        return session, client.socket_url(f"/v1/sessions/{session}/stream")


@asynccontextmanager
async def open_raw_viewer(url: str, receive_buffer_bytes: int | None = None) -> AsyncIterator[socket.socket]:
    """A viewer of no more than a socket, which answers nothing; `buffer` is what its system keeps for it."""
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
    """The payloads of a server's frames that are there whole, and what is left."""
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
    async with asyncio.timeout(60):
        while await viewer_count(server, session) != number:  # noqa: ASYNC110
            await asyncio.sleep(0.05)


async def test_one_who_stops_reading_skips_to_the_newest_and_holds_up_nobody(
    server: str, clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    buses: list[MemoryBus] = []
    publish = MemoryBus.publish

    def seen(self: MemoryBus, subject: str, data: bytes) -> None:
        buses.append(self)
        publish(self, subject, data)

    monkeypatch.setattr(MemoryBus, "publish", seen)
    session, url = await open_session(server, clip_file)
    crowd = LoadGenerator(url)
    await crowd.join(3)
    await wait_for_viewer_count(server, session, 3)
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(90), open_raw_viewer(url, 4096) as stopped:
        await wait_for_viewer_count(server, session, 4)
        # the largest that there are: more of them than a socket takes, sent as a stage sends
        frame: dict[int, tuple[int, ...]] = dict.fromkeys(range(4), (7,) * 9)
        sent, last = 2_000, 0
        for number in range(1, sent + 1):
            message = Overlay(number, 1 << 50, frame, (frame,) * 3).pack()
            buses[-1].publish(f"session.{session}.overlay", message)
            if number % 20 == 0:
                await asyncio.sleep(0.001)
        size, data = len(message) + 4, b""
        found: list[int] = []
        while last != sent:
            data += await loop.sock_recv(stopped, 1 << 16)
            payloads, data = split_frames(data)
            # a line that is full gets their last frames alone
            found += [Overlay.unpack(payload).sequence for payload in payloads if payload[:1] == b"\x05"]
            last = found[-1] if found else 0
        # two socket buffers and a message; all of them would be a megabyte
        assert len(found) < sent / 2
        assert len(found) * size < 256 << 10
        while len(crowd.state.overlay_lateness) < 3 * sent:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    assert not any(viewer.closed for viewer in crowd.viewers)
    await crowd.close()


async def test_one_that_is_no_longer_there_is_let_go(
    server: str, clip_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(heartbeat, "PING_AFTER_US", 200_000)
    monkeypatch.setattr(heartbeat, "HEARTBEAT_TIMEOUT_US", 1_200_000)
    session, url = await open_session(server, clip_file)
    # one that answers is there as long as it likes
    crowd = LoadGenerator(url, single_reporter=True)
    await crowd.join(2)
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(60), open_raw_viewer(url) as silent:
        await wait_for_viewer_count(server, session, 3)
        asked = b""
        with contextlib.suppress(ConnectionError):
            while part := await loop.sock_recv(silent, 1 << 16):
                asked += part
        assert b"\x89\x00" in asked
        await wait_for_viewer_count(server, session, 2)
    assert not any(viewer.closed for viewer in crowd.viewers)
    await crowd.close()


async def test_a_flash_crowd_and_its_going_leave_the_others_in_peace(server: str, clip_file: Path) -> None:
    session, url = await open_session(server, clip_file)
    there, flash = LoadGenerator(url), LoadGenerator(url)
    await there.join(3)
    async with Client(server) as client, Puppeteer(client, session, "one") as puppeteer:
        await puppeteer.claim("left_hand")
        await puppeteer.target("left_hand", 0.45, 0.0, 0.5)
        await flash.join(150, 400)
        await wait_for_viewer_count(server, session, 153)
        figures = flash.statistics()
        assert (figures.joined, figures.refused, figures.dropped) == (150, 0, 0)
        await flash.close()
        await wait_for_viewer_count(server, session, 3)
        before = len(there.state.overlay_lateness)
        await puppeteer.target("left_hand", 0.45, -0.2, 0.5)
        async with asyncio.timeout(30):
            while len(there.state.overlay_lateness) < before + 30:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
    assert not any(viewer.closed for viewer in there.viewers)
    assert there.state.block_lateness
    await there.close()
