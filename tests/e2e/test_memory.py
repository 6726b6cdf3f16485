"""Memory of a server whose clients leave: what belonged to them is freed at once, without a garbage collection.

Objects in a reference cycle would stay until a collection of all generations, which takes hours to come.
"""

from __future__ import annotations

import asyncio
import gc
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from bunraku.client import Client, Puppeteer
from bunraku.session.puppeteer_connection import PuppeteerConnection
from bunraku.session.stage import Stage
from bunraku.session.stage_endpoint import StageEndpoint
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.handoff import HandoffProtocol
from tests.servers import run_server
from tests.stream.test_app import message, socket
from tests.time_limit import HANG_TIMEOUT_S

OWNED_BY_CLIENTS = (
    HandoffProtocol,
    PuppeteerConnection,
    Stage,
    StageEndpoint,
    ViewerConnection,
    WebSocketConnection,
)


@pytest.fixture
def no_collections(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    # frozen objects, those of a server that is warmed up, would not be listed
    monkeypatch.setattr(gc, "freeze", lambda: None)
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("no_collections")
async def test_clients_that_left_leave_no_object_behind(tmp_path: Path, clip_file: Path) -> None:
    before = count_objects()
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
            assert count_objects()[Stage] > before[Stage]
            await client._request("DELETE", f"/v1/sessions/{session}")
            await wait_until_freed(before)


async def wait_until_freed(before: Counter[type]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while count_objects() - before:  # noqa: ASYNC110 - nothing announces that an object is freed
            await asyncio.sleep(0.1)


def count_objects() -> Counter[type]:
    """Return the number of living objects of each type of `OWNED_BY_CLIENTS`."""
    return Counter(type(each) for each in gc.get_objects() if type(each) in OWNED_BY_CLIENTS)
