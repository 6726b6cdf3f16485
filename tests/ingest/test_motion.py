from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from bunraku.ingest.motion import UploadOperation, derive_motion_id
from bunraku.runtime.context import open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from tests.servers import make_bvh_clip


def test_ids_are_short_plain_and_of_the_bytes() -> None:
    one = derive_motion_id(hashlib.sha256(b"1").digest())
    assert len(one) == 20
    assert set(one) <= set("abcdefghijklmnopqrstuvwxyz234567")
    assert one != derive_motion_id(hashlib.sha256(b"2").digest())


async def test_a_failed_upload_leaves_nothing_and_a_good_one_everything(tmp_path: Path) -> None:
    source = tmp_path / "source"
    async with open_context(Settings(data=tmp_path / "data")) as backing:
        uploads = UploadOperation(backing)
        source.write_bytes(b"no motion")
        with pytest.raises(ProblemError) as refused:
            await uploads.ingest_file("m1", source, "x.bvh")
        assert refused.value.status == 422
        assert await backing.catalogue.get_motion("m1") is None
        assert await backing.motion_store.get("m1") is None
        source.write_bytes(make_bvh_clip(0.4))
        entry, new = await uploads.ingest_file("m1", source, "../odd/na\x00me.bvh")
        assert new
        assert "/" not in entry.description["name"]
        assert await backing.motion_store.get("m1") is not None
        assert (await uploads.ingest_file("m1", source, "x.bvh")) == (entry, False)


async def test_a_job_that_another_replica_takes_up_is_still_its_sender_s(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.4))
    async with open_context(Settings(data=tmp_path / "data")) as backing:
        uploads = UploadOperation(backing)
        await uploads.job_queue.handlers["motion"]({"motion": "m1", "filename": "a.bvh", "subject": "aiko"}, source)
        found = await backing.catalogue.get_motion("m1")
        assert found is not None
        assert found.subject == "aiko"
        assert found.bytes > 0
