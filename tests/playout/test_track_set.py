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
def motion_track() -> dict[str, Any]:
    return encode_motion(random_motion(2.0, 30.0, 3), error_bounds_mm=(30.0, 5.0), grade="live").describe()


def test_motion_track_is_found_and_unknown_tracks_are_skipped(motion_track: dict[str, Any]) -> None:
    tracks = TrackSet([{"type": "smell"}, motion_track, {"type": "camera", "codec": "later"}, {"type": "audio"}])
    assert isinstance(tracks.store(1), MotionBlockStore)
    assert tracks.store(1) is tracks.first_performer
    assert [tracks.store(number) for number in (0, 2, 3, 9)] == [None] * 4
    assert (tracks.scenes, tracks.audio, tracks.described_count) == ([], None, 4)
    assert tracks.kbps == [rate["kbps"] for rate in motion_track["rates"]]


def test_described_tracks_are_not_added_again(motion_track: dict[str, Any]) -> None:
    tracks = TrackSet([motion_track])
    first_store = tracks.first_performer
    tracks.add(0, [motion_track, {"type": "smell"}])
    tracks.add(1, [{"type": "smell"}])
    assert (tracks.first_performer, tracks.described_count) == (first_store, 2)


def test_performers_keep_their_number_after_unplayable_ones(motion_track: dict[str, Any]) -> None:
    placed = motion_track | {"place": [1.0, -0.5, 2]}
    tracks = TrackSet([motion_track, {"type": "camera", "codec": "later"}, placed])
    assert tracks.performers[0] is tracks.first_performer
    assert tracks.placements == [STAGE_CENTRE, Placement(1.0, -0.5, 2.0)]
    assert tracks.store(2) is tracks.performers[1] is not None
    tracks.add(3, [motion_track | {"codec": "later"}, motion_track | {"place": [0.0, 900.0, 0.0]}, motion_track])
    assert [store is not None for store in tracks.performers] == [True, True, False, False]
    assert tracks.store(5) is None


@pytest.mark.parametrize("described", [[], [{"type": "camera"}], [{"type": "motion", "codec": "later"}]])
def test_description_without_motion_is_rejected(described: list[dict[str, Any]]) -> None:
    with pytest.raises(DamagedBlock):
        TrackSet(described)


def test_invalid_placement_of_first_performer_is_rejected(motion_track: dict[str, Any]) -> None:
    with pytest.raises(DamagedBlock, match="invalid placement"):
        TrackSet([motion_track | {"place": [0.0, 900.0, 0.0]}, motion_track])
