from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import JobResult
from bunraku.runtime.context import open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings

RESULT = JobResult(b"packed", {})


async def test_motion_beyond_the_quota_leaves_no_object(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path, total_motions=1)) as context:
        await check_quota(context, "aiko")
        entry, is_new = await store_motion(context, "m1", RESULT, {"name": "one"}, "aiko")
        assert (is_new, entry.subject, entry.bytes) == (True, "aiko", len(RESULT.packed))
        with pytest.raises(ProblemError, match="at most 1 motions") as raised:
            await check_quota(context, "aiko")
        assert (raised.value.status, raised.value.title) == (403, "Quota used up")
        before = sorted(path for path in tmp_path.rglob("*") if "m1" in path.name)  # noqa: ASYNC240
        with pytest.raises(ProblemError, match="at most 1 motions"):
            await store_motion(context, "m2", RESULT, {}, "ben")
        assert await context.catalogue.get_motion("m2") is None
        assert not [path for path in tmp_path.rglob("*") if "m2" in path.name]  # noqa: ASYNC240
        # storing a known motion needs no quota and changes nothing
        known, is_new = await store_motion(context, "m1", RESULT, {"name": "two"}, "ben")
        assert (is_new, known.subject, known.description) == (False, "aiko", {"name": "one"})
        assert sorted(path for path in tmp_path.rglob("*") if "m1" in path.name) == before  # noqa: ASYNC240
