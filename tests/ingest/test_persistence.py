from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import JobResult
from bunraku.runtime.context import open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings

RESULT = JobResult(b"packed", {})


async def test_what_is_beyond_a_quota_leaves_no_object_and_what_was_there_keeps_its_own(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path, total_motions=1)) as backing:
        await check_quota(backing, "aiko")
        entry, new = await store_motion(backing, "m1", RESULT, {"name": "one"}, "aiko")
        assert (new, entry.subject, entry.bytes) == (True, "aiko", len(RESULT.packed))
        with pytest.raises(ProblemError, match="1 motions") as refused:
            await check_quota(backing, "aiko")
        assert (refused.value.status, refused.value.title) == (403, "Quota used up")
        before = sorted(path for path in tmp_path.rglob("*") if "m1" in path.name)  # noqa: ASYNC240
        with pytest.raises(ProblemError, match="1 motions"):
            await store_motion(backing, "m2", RESULT, {}, "ben")
        assert await backing.catalogue.get_motion("m2") is None
        assert not [path for path in tmp_path.rglob("*") if "m2" in path.name]  # noqa: ASYNC240
        # the same again is no more than there was, and stays whose it was
        again, new = await store_motion(backing, "m1", RESULT, {"name": "two"}, "ben")
        assert (new, again.subject, again.description) == (False, "aiko", {"name": "one"})
        assert sorted(path for path in tmp_path.rglob("*") if "m1" in path.name) == before  # noqa: ASYNC240
