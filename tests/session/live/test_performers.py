from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from bunraku.client import Client, ServerProblem
from bunraku.motion.skeleton import standard_figure
from bunraku.runtime.settings import Settings
from bunraku.storage.motion_store import MotionStore
from bunraku.storage.performance_store import PerformanceStore
from bunraku.wire.live import Sample
from bunraku.wire.messages import SUBPROTOCOL
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S


async def test_last_samples_are_stored_when_the_server_stops(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_part = PerformanceStore.put_part

    async def put_part_slowly(*arguments: Any) -> None:
        await asyncio.sleep(0.5)
        await put_part(*arguments)

    monkeypatch.setattr(PerformanceStore, "put_part", put_part_slowly)
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            performer = await client.create_performer({"name": "Aiko"})
            address = client.socket_url(performer["input"])
            async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]
                await socket.send(json.dumps({"root": [0.25, 0.9, 0.0]}))
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    while not (await client.performer(performer["id"]))["samples"]["applied"]:  # noqa: ASYNC110
                        await asyncio.sleep(0)
    store = MotionStore.open(Settings(data=tmp_path).library_url()).performances
    parts = await store.load(performer["id"], (await store.list_performances())[performer["id"]])
    assert [Sample.unpack(part).root[0] for part in parts] == [0.25]


async def test_refused_performer_leaves_nothing(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            for wrong, status in (
                ({"session": "unknown"}, 404),
                ({"place": [0, 1000, 0]}, 422),
                ({"fps": 5}, 422),
                ({"figure": {"offsets": {"l_elbow": [0.0, 0.0, 0.0]}, "tips": {}}}, 422),
                ({"figure": _figure() | {"tips": {}}}, 422),
                ({"figure": _figure(l_elbow=[0.0, -0.001, 0.0])}, 422),
            ):
                with pytest.raises(ServerProblem) as refused:
                    await client.create_performer(wrong)
                assert refused.value.status == status, wrong
    store = MotionStore.open(Settings(data=tmp_path).library_url())
    assert await store.performances.list_performances() == {}
    assert [one async for one in store.list_objects("motions") if one] == []


@pytest.mark.parametrize("performer", ["unknown", "a-b", ".", "%2e%2e", "x" * 100])
async def test_unknown_performer_has_no_socket(server: str, performer: str) -> None:
    address = server.replace("http", "ws") + f"/v1/performers/{performer}/input"
    async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]
        await socket.recv()
        with pytest.raises(ConnectionClosed) as closed:
            await socket.recv()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4404


def _figure(**changes: list[float]) -> dict[str, dict[str, list[float]]]:
    from bunraku.client.performer import _figure_json

    figure = _figure_json(standard_figure())
    return figure | {"offsets": figure["offsets"] | changes}
