from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.backing.backing import open_backing
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.ingest.results import Made
from bunraku.ingest.storing import check_room, store

MADE = Made(b"packed", {})


async def test_what_is_beyond_a_quota_leaves_no_object_and_what_was_there_keeps_its_own(tmp_path: Path) -> None:
    async with open_backing(Settings(data=tmp_path, total_motions=1)) as backing:
        await check_room(backing, "aiko")
        entry, new = await store(backing, "m1", MADE, {"name": "one"}, "aiko")
        assert (new, entry.subject, entry.bytes) == (True, "aiko", len(MADE.packed))
        with pytest.raises(ProblemError, match="1 motions") as refused:
            await check_room(backing, "aiko")
        assert (refused.value.status, refused.value.title) == (403, "Quota used up")
        before = sorted(path for path in tmp_path.rglob("*") if "m1" in path.name)  # noqa: ASYNC240
        with pytest.raises(ProblemError, match="1 motions"):
            await store(backing, "m2", MADE, {}, "ben")
        assert await backing.catalogue.get("m2") is None
        assert not [path for path in tmp_path.rglob("*") if "m2" in path.name]  # noqa: ASYNC240
        # the same again is no more than there was, and stays whose it was
        again, new = await store(backing, "m1", MADE, {"name": "two"}, "ben")
        assert (new, again.subject, again.description) == (False, "aiko", {"name": "one"})
        assert sorted(path for path in tmp_path.rglob("*") if "m1" in path.name) == before  # noqa: ASYNC240
