from __future__ import annotations

from typing import Any

import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_encoder import encode_motion
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.playout.block_store import MotionBlockStore
from bunraku.playout.track_set import TrackSet
from tests.vectors.blocks import random_motion


@pytest.fixture(scope="module")
def dance() -> dict[str, Any]:
    return encode_motion(random_motion(2.0, 30.0, 3), error_bounds_mm=(30.0, 5.0), grade="live").describe()


def test_the_dance_is_found_wherever_it_stands_and_what_is_not_known_is_skipped(dance: dict[str, Any]) -> None:
    tracks = TrackSet([{"type": "smell"}, dance, {"type": "camera", "codec": "later"}, {"type": "audio"}])
    assert isinstance(tracks.store(1), MotionBlockStore)
    assert tracks.store(1) is tracks.first_performer
    assert [tracks.store(number) for number in (0, 2, 3, 9)] == [None] * 4
    assert (tracks.scenes, tracks.audio, tracks.described_count) == ([], None, 4)
    assert tracks.kbps == [rate["kbps"] for rate in dance["rates"]]


def test_what_was_told_of_is_not_taken_in_again(dance: dict[str, Any]) -> None:
    tracks = TrackSet([dance])
    kept = tracks.first_performer
    tracks.add(0, [dance, {"type": "smell"}])
    tracks.add(1, [{"type": "smell"}])
    assert (tracks.first_performer, tracks.described_count) == (kept, 2)


def test_performers_are_numbered_in_order_also_behind_one_that_cannot_be_shown(dance: dict[str, Any]) -> None:
    placed = dance | {"place": [1.0, -0.5, 2]}
    tracks = TrackSet([dance, {"type": "camera", "codec": "later"}, placed])
    assert tracks.performers[0] is tracks.first_performer
    assert tracks.placements == [STAGE_CENTRE, Placement(1.0, -0.5, 2.0)]
    assert tracks.store(2) is tracks.performers[1] is not None
    tracks.add(3, [dance | {"codec": "later"}, dance | {"place": [0.0, 900.0, 0.0]}, dance])
    assert [store is not None for store in tracks.performers] == [True, True, False, False]
    assert tracks.store(5) is None


@pytest.mark.parametrize("described", [[], [{"type": "camera"}], [{"type": "motion", "codec": "later"}]])
def test_without_a_dance_there_is_nothing_to_show(described: list[dict[str, Any]]) -> None:
    with pytest.raises(DamagedBlock):
        TrackSet(described)


def test_without_a_place_for_the_first_there_is_nothing_to_show(dance: dict[str, Any]) -> None:
    with pytest.raises(DamagedBlock, match="invalid placement"):
        TrackSet([dance | {"place": [0.0, 900.0, 0.0]}, dance])
