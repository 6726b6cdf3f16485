from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.ingest.derived_motion import Derivation, DerivationJob, DerivedMotionFactory
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.motion_id import derive_digest
from bunraku.storage.record import CatalogueEntry
from tests.vectors.blocks import random_motion

ENCODED = encode_motion(random_motion(1.2, 30.0, 3), error_bounds_mm=(30.0,), grade="live")


async def make_factory(context: ServiceContext) -> DerivedMotionFactory:
    await context.motion_store.put("one", pack_motion("one", ENCODED))
    await context.catalogue.add_motion(CatalogueEntry("one", 5, {"name": "One"}))
    return DerivedMotionFactory(context, WorkerSlots())


async def build_description(source: CatalogueEntry, result: JobResult) -> dict[str, Any]:
    return {**source.description, **result.description}


def make_derivation(key: bytes, run: DerivationJob) -> Derivation:
    return Derivation("one", derive_digest("one", key), run, build_description, problem_members={"filename": "a.wav"})


async def test_derivation_is_repeated_only_without_its_object(tmp_path: Path) -> None:
    created: list[str] = []

    async def copy(new_id: str, stored: StoredMotion) -> JobResult:
        assert stored.id == "one"
        created.append(new_id)
        return JobResult(pack_motion(new_id, ENCODED), {"made_from": stored.id})

    async with open_context(Settings(data=tmp_path)) as context:
        factory = await make_factory(context)
        first, is_new = await factory.find_or_create(make_derivation(b" a", copy))
        assert is_new
        assert first.description == {"name": "One", "made_from": "one"}
        assert await factory.find_or_create(make_derivation(b" a", copy)) == (first, False)
        other, is_new = await factory.find_or_create(make_derivation(b" b", copy))
        assert is_new
        assert created == [first.id, other.id]
        await context.motion_store.remove(first.id)
        again, is_new = await factory.find_or_create(make_derivation(b" a", copy))
        assert (again.id, is_new) == (first.id, True)


async def test_rejected_derivation_stores_nothing(tmp_path: Path) -> None:
    async def reject(_: str, __: StoredMotion) -> JobRejection:
        return JobRejection("No", "it is invalid", field="camera")

    async with open_context(Settings(data=tmp_path)) as context:
        factory = await make_factory(context)
        with pytest.raises(ProblemError, match="it is invalid") as raised:
            await factory.find_or_create(make_derivation(b" a", reject))
        assert raised.value.extra["filename"] == "a.wav"
        with pytest.raises(ProblemError, match="no motion 'two'"):
            await factory.require_motion("two")
        entries, _ = await context.catalogue.list_motions(10)
        assert [entry.id for entry in entries] == ["one"]
