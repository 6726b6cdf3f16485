from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from bunraku.backing.backing import open_backing
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.ingest.uploads import Uploads, motion_id
from tests.servers import clip


def test_ids_are_short_plain_and_of_the_bytes() -> None:
    one = motion_id(hashlib.sha256(b"1").digest())
    assert len(one) == 20
    assert set(one) <= set("abcdefghijklmnopqrstuvwxyz234567")
    assert one != motion_id(hashlib.sha256(b"2").digest())


async def test_a_failed_upload_leaves_nothing_and_a_good_one_everything(tmp_path: Path) -> None:
    source = tmp_path / "source"
    async with open_backing(Settings(data=tmp_path / "data")) as backing:
        uploads = Uploads(backing)
        source.write_bytes(b"no motion")
        with pytest.raises(ProblemError) as refused:
            await uploads.add("m1", source, "x.bvh")
        assert refused.value.status == 422
        assert await backing.catalogue.get("m1") is None
        assert await backing.library.get("m1") is None
        source.write_bytes(clip(0.4))
        entry, new = await uploads.add("m1", source, "../odd/na\x00me.bvh")
        assert new
        assert "/" not in entry.description["name"]
        assert await backing.library.get("m1") is not None
        assert (await uploads.add("m1", source, "x.bvh")) == (entry, False)


async def test_a_job_that_another_replica_takes_up_is_still_its_sender_s(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(clip(0.4))
    async with open_backing(Settings(data=tmp_path / "data")) as backing:
        uploads = Uploads(backing)
        await uploads.queue.kinds["motion"]({"motion": "m1", "filename": "a.bvh", "subject": "aiko"}, source)
        found = await backing.catalogue.get("m1")
        assert found is not None
        assert found.subject == "aiko"
        assert found.bytes > 0
