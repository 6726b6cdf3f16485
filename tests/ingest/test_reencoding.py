from __future__ import annotations

import asyncio
from pathlib import Path

import httpx2
import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.ingest.persistence import store_motion
from bunraku.ingest.reencoding import ReencodingOperation
from bunraku.ingest.result import JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.integrity import hide_incomplete_motions
from bunraku.storage.record import CatalogueEntry
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion


async def store_old_motion(context: ServiceContext) -> CatalogueEntry:
    """Store a motion as an encoder without refinement encodes it."""
    encoded = encode_motion(random_motion(2.0, 30.0, 5), grade="live")
    description = {"name": "crane", "tags": ["slow"], "rates": encoded.describe()["rates"]}
    return (await store_motion(context, "m1", JobResult(pack_motion("m1", encoded), {}), description, "aiko")).entry


async def test_motion_is_encoded_again_in_place(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path, total_motions=1)) as context:
        before = await store_old_motion(context)
        loaded = await context.motion_store.get("m1")
        assert loaded is not None
        after = await ReencodingOperation(context, WorkerSlots()).reencode("m1", "aiko")
        assert (after.id, after.created, after.subject) == (before.id, before.created, before.subject)
        assert (after.description["name"], after.description["tags"]) == ("crane", ["slow"])
        assert after.bytes < before.bytes
        assert await context.motion_store.object_sizes(["m1"]) == [after.bytes]
        assert await context.catalogue.get_motion("m1") == after
        stored = await context.motion_store.get("m1")
        assert stored is not None
        assert stored is not loaded
        assert stored.packets[0][-1] == loaded.packets[0][-1]
        kbps = [rate["kbps"] for rate in after.description["rates"]]
        assert kbps == pytest.approx(stored.bitrates_kbps[0], abs=1e-3)
        assert all(new < old["kbps"] for new, old in zip(kbps[:-1], before.description["rates"], strict=False))
        assert await hide_incomplete_motions(context.catalogue, context.motion_store) == 0


async def test_interrupted_replacement_leaves_a_complete_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        before = await store_old_motion(context)
        operation = ReencodingOperation(context, WorkerSlots())

        async def fail(*_: object) -> None:
            raise OSError("power lost")

        with monkeypatch.context() as patch:
            patch.setattr(context.motion_store, "put", fail)
            with pytest.raises(OSError, match="power lost"):
                await operation.reencode("m1")
        assert await hide_incomplete_motions(context.catalogue, context.motion_store) == 0
        assert await context.motion_store.object_sizes(["m1"]) == [before.bytes]
        after = await operation.reencode("m1")
        assert after.bytes < before.bytes


async def test_client_that_leaves_during_the_replacement_leaves_a_motion_of_known_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        before = await store_old_motion(context)
        put, has_begun, may_go_on = context.motion_store.put, asyncio.Event(), asyncio.Event()

        async def put_slowly(motion_id: str, packed: bytes) -> None:
            has_begun.set()
            await may_go_on.wait()
            await put(motion_id, packed)

        monkeypatch.setattr(context.motion_store, "put", put_slowly)
        running = asyncio.create_task(ReencodingOperation(context, WorkerSlots()).reencode("m1"))
        await has_begun.wait()
        running.cancel()
        may_go_on.set()
        await asyncio.wait((running,))
        assert running.cancelled()
        after = await context.catalogue.get_motion("m1")
        assert after is not None
        assert 0 < after.bytes < before.bytes
        assert await context.motion_store.object_sizes(["m1"]) == [after.bytes]


async def test_motion_that_is_removed_meanwhile_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        await store_old_motion(context)
        put = context.motion_store.put

        async def put_after_removal(motion_id: str, packed: bytes) -> None:
            await context.catalogue.remove_motion(motion_id)
            await put(motion_id, packed)

        monkeypatch.setattr(context.motion_store, "put", put_after_removal)
        with pytest.raises(ProblemError) as raised:
            await ReencodingOperation(context, WorkerSlots()).reencode("m1")
        assert raised.value.status == 404
        assert await context.motion_store.object_sizes(["m1"]) == [None]


async def test_new_motion_stays_as_it_is(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        uploaded = await http.post("/v1/motions", params={"filename": "a.bvh"}, content=make_bvh_clip(2.0, 4711))
        motion = uploaded.json()
        response = await http.post(f"/v1/motions/{motion['id']}/encodings")
        assert response.status_code == 200, response.text
        assert response.json()["rates"][-1] == motion["rates"][-1]
        assert [rate["max"] for rate in response.json()["rates"]] == [rate["max"] for rate in motion["rates"]]
        missing = await http.post("/v1/motions/ZZ/encodings")
        assert (missing.status_code, missing.json()["title"]) == (404, "No such motion")
