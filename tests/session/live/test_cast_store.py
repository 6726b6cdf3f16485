from pathlib import Path

import pytest

from bunraku.motion.skeleton import standard_figure
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.cast import Cast, CastMember
from bunraku.session.live.cast_store import CastStore
from bunraku.storage.motion_store import MotionStore

AIKO, YUKI = (CastMember(f"s-{number}", "", 60.0, None) for number in (1, 2))


@pytest.fixture
def motions(tmp_path: Path) -> MotionStore:
    return MotionStore.open(tmp_path.as_uri())


async def stored_ids(motions: MotionStore) -> set[str]:
    found: set[str] = set()
    async for chunk in motions.list_objects("motions"):
        found |= {one.path.rpartition("/")[2].partition(".")[0] for one in chunk}
    return found


async def test_cast_motion_is_made_once_and_removed_with_what_nobody_else_needs(motions: MotionStore) -> None:
    casts = CastStore(motions)
    for member in (AIKO, YUKI):
        await casts.put_figure(member, standard_figure())
    both, alone = Cast("", (AIKO, YUKI)), Cast("", (AIKO,))
    stored = await casts.load(both)
    assert len(stored.performers) == 2
    assert await casts.load(both) is stored
    assert len((await casts.load(alone)).performers) == 1
    await casts.refresh(both)
    await casts.remove(both, alone)
    assert await stored_ids(motions) == {alone.motion, AIKO.rest_motion}
    await casts.remove(alone)
    assert await stored_ids(motions) == set()


async def test_cast_without_its_figures_or_base_is_refused(motions: MotionStore) -> None:
    casts = CastStore(motions)
    for cast in (Cast("", (AIKO,)), Cast("abcdefghij234567abcd", (AIKO,))):
        with pytest.raises(ProblemError) as refused:
            await casts.load(cast)
        assert refused.value.status == 404


async def test_full_stage_is_refused(motions: MotionStore) -> None:
    casts = CastStore(motions)
    members = tuple(CastMember(f"s-{number}", "", 60.0, None) for number in range(5))
    for member in members:
        await casts.put_figure(member, standard_figure())
    with pytest.raises(ProblemError) as refused:
        await casts.load(Cast("", members))
    assert (refused.value.status, refused.value.title) == (409, "Stage full")
