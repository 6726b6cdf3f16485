from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.catalogue import Entry
from bunraku.backing.library import StoredMotion, pack
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.codec.encode import encode_motion
from bunraku.ingest.derived import Derived
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.uploads import Uploads
from tests.vectors.blocks import wandering_motion

ENCODED = encode_motion(wandering_motion(1.2, 30.0, 3), ladder=(30.0,), grade="live")


async def with_one(backing: Backing) -> Derived:
    await backing.library.put("one", pack("one", ENCODED))
    await backing.catalogue.add(Entry("one", 5, {"name": "One"}))
    return Derived(backing, Uploads(backing))


async def described(before: Entry, made: Made) -> dict[str, Any]:
    return {**before.description, **made.described}


async def test_the_same_is_made_once_and_again_where_its_object_is_gone(tmp_path: Path) -> None:
    made: list[str] = []

    async def copy(new: str, stored: StoredMotion) -> Made:
        assert stored.id == "one"
        made.append(new)
        return Made(pack(new, ENCODED), {"made_from": stored.id})

    async with open_backing(Settings(data=tmp_path)) as backing:
        derived = await with_one(backing)
        first, new = await derived.add("one", b" a", copy, described)
        assert new
        assert first.description == {"name": "One", "made_from": "one"}
        assert await derived.add("one", b" a", copy, described) == (first, False)
        other, new = await derived.add("one", b" b", copy, described)
        assert new
        assert made == [first.id, other.id]
        await backing.library.remove(first.id)
        again, new = await derived.add("one", b" a", copy, described)
        assert (again.id, new) == (first.id, True)


async def test_what_a_job_refuses_or_is_not_there_is_said_and_leaves_nothing(tmp_path: Path) -> None:
    async def refuse(_: str, __: StoredMotion) -> Refused:
        return Refused("No", "it cannot be", field="camera")

    async with open_backing(Settings(data=tmp_path)) as backing:
        derived = await with_one(backing)
        with pytest.raises(ProblemError, match="it cannot be") as raised:
            await derived.add("one", b" a", refuse, described, filename="a.wav")
        assert raised.value.extra["filename"] == "a.wav"
        with pytest.raises(ProblemError, match="no motion 'two'"):
            await derived.known("two")
        entries, _ = await backing.catalogue.page(10)
        assert [entry.id for entry in entries] == ["one"]
