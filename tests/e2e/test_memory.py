"""Memory of a server whose clients leave: what belonged to them is freed at once, without a garbage collection.

Objects in a reference cycle would stay until a collection of all generations, which takes hours to come.
"""

from __future__ import annotations

import asyncio
import functools
import gc
import socket as sockets
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from uvicorn.protocols.http.h11_impl import RequestResponseCycle
from websockets import Origin
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.server import ServerProtocol

from bunraku.client import Client, Puppeteer
from bunraku.http.protocol import HttpProtocol
from bunraku.session.live.performer_connection import PerformerConnection
from bunraku.session.puppeteer_connection import PuppeteerConnection
from bunraku.session.stage import Stage
from bunraku.session.stage_endpoint import StageEndpoint
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.stream.watched_session import WatchedSession
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.handoff import HandoffProtocol
from tests.servers import run_server
from tests.stream.test_app import message, socket
from tests.time_limit import HANG_TIMEOUT_S

OWNED_BY_CLIENTS = (
    HandoffProtocol,
    HttpProtocol,
    PerformerConnection,
    PuppeteerConnection,
    RequestResponseCycle,
    ServerProtocol,
    Stage,
    StageEndpoint,
    ViewerConnection,
    WatchedSession,
    WebSocketConnection,
)


@pytest.fixture
def living(monkeypatch: pytest.MonkeyPatch) -> Iterator[Counter[type]]:
    """Count the living objects of `OWNED_BY_CLIENTS`, while no collection frees those that are in a cycle.

    `gc.get_objects` would also return tuples that another thread is still building, which then fails there.
    """
    counts: Counter[type] = Counter()
    for owned in OWNED_BY_CLIENTS:
        monkeypatch.setattr(owned, "__init__", _counting(counts, owned.__init__))
        monkeypatch.setattr(owned, "__del__", lambda self: counts.subtract((type(self),)), raising=False)
    gc.collect()
    gc.disable()
    yield counts
    gc.enable()


def _counting(counts: Counter[type], initialise: Callable[..., None]) -> Callable[..., None]:
    """Return `initialise` so that it also counts its object."""

    @functools.wraps(initialise)
    def initialise_and_count(self: object, *arguments: Any, **options: Any) -> None:
        counts[type(self)] += 1
        initialise(self, *arguments, **options)

    return initialise_and_count


async def test_clients_that_left_leave_no_object_behind(tmp_path: Path, clip_file: Path, living: Counter[type]) -> None:
    with run_server(tmp_path / "data") as url:
        async with Client(url) as client:
            motion = (await client.upload(clip_file))["id"]
            session = (await client.open_session(motion))["id"]
            for path in (f"/v1/motions/{motion}/stream", f"/v1/sessions/{session}/stream"):
                async with socket(url, path) as viewer:
                    await message(viewer)
                async with socket(url, path) as viewer:
                    await message(viewer)
                    viewer.transport.abort()
            async with Puppeteer(client, session, "Aiko") as puppeteer:
                await puppeteer.claim("left_hand")
                await puppeteer.target("left_hand", 0.5, 0.2, 0.4)
            async with socket(url, "/v1/sessions/unknown/stream") as refused:
                await message(refused)
                with pytest.raises(ConnectionClosed):
                    await refused.recv()
            with pytest.raises(InvalidStatus):
                await connect(
                    f"{url.replace('http', 'ws')}/v1/motions/{motion}/stream", origin=Origin("https://other.example")
                )
            async with client.perform(session=session) as performer:
                assert living[PerformerConnection] == 1
                await performer.describe()
            await begin_upload(url)
            assert living[Stage] == living[StageEndpoint] == 1
            await client._request("DELETE", f"/v1/sessions/{session}")
        await wait_until_freed(living)


async def begin_upload(url: str) -> None:
    """Begin an upload and reset its connection once the server reads the body."""
    parts = urlsplit(url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    fields = "Host: a\r\nContent-Length: 1000000\r\nExpect: 100-continue"
    writer.write(f"POST /v1/motions?filename=a.bvh HTTP/1.1\r\n{fields}\r\n\r\n".encode())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await reader.readuntil(b"100")
    writer.write(b"x" * 100_000)
    await writer.drain()
    writer.get_extra_info("socket").setsockopt(sockets.SOL_SOCKET, sockets.SO_LINGER, struct.pack("ii", 1, 0))
    writer.transport.abort()


async def wait_until_freed(living: Counter[type]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while +living:  # noqa: ASYNC110 - nothing announces that an object is freed
            await asyncio.sleep(0.1)
