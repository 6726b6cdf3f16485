from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.ingest.derived_motion import DerivedMotionFactory
from bunraku.ingest.motion import UploadOperation
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.record import CatalogueEntry
from tests.vectors.blocks import random_motion

ENCODED = encode_motion(random_motion(1.2, 30.0, 3), error_bounds_mm=(30.0,), grade="live")


async def make_factory(backing: ServiceContext) -> DerivedMotionFactory:
    await backing.motion_store.put("one", pack_motion("one", ENCODED))
    await backing.catalogue.add_motion(CatalogueEntry("one", 5, {"name": "One"}))
    return DerivedMotionFactory(backing, UploadOperation(backing))


async def build_description(before: CatalogueEntry, made: JobResult) -> dict[str, Any]:
    return {**before.description, **made.description}


async def test_the_same_is_made_once_and_again_where_its_object_is_gone(tmp_path: Path) -> None:
    made: list[str] = []

    async def copy(new: str, stored: StoredMotion) -> JobResult:
        assert stored.id == "one"
        made.append(new)
        return JobResult(pack_motion(new, ENCODED), {"made_from": stored.id})

    async with open_context(Settings(data=tmp_path)) as backing:
        derived = await make_factory(backing)
        first, new = await derived.find_or_create("one", b" a", copy, build_description)
        assert new
        assert first.description == {"name": "One", "made_from": "one"}
        assert await derived.find_or_create("one", b" a", copy, build_description) == (first, False)
        other, new = await derived.find_or_create("one", b" b", copy, build_description)
        assert new
        assert made == [first.id, other.id]
        await backing.motion_store.remove(first.id)
        again, new = await derived.find_or_create("one", b" a", copy, build_description)
        assert (again.id, new) == (first.id, True)


async def test_what_a_job_refuses_or_is_not_there_is_said_and_leaves_nothing(tmp_path: Path) -> None:
    async def refuse(_: str, __: StoredMotion) -> JobRejection:
        return JobRejection("No", "it cannot be", field="camera")

    async with open_context(Settings(data=tmp_path)) as backing:
        derived = await make_factory(backing)
        with pytest.raises(ProblemError, match="it cannot be") as raised:
            await derived.find_or_create("one", b" a", refuse, build_description, filename="a.wav")
        assert raised.value.extra["filename"] == "a.wav"
        with pytest.raises(ProblemError, match="no motion 'two'"):
            await derived.require_motion("two")
        entries, _ = await backing.catalogue.list_motions(10)
        assert [entry.id for entry in entries] == ["one"]
