from __future__ import annotations

from typing import Any

import pytest

from bunraku.codec.encode import encode_motion
from bunraku.codec.errors import DamagedBlock
from bunraku.motion.place import MIDDLE, Place
from bunraku.playout.blocks import BlockStore
from bunraku.playout.tracks import Tracks
from tests.vectors.blocks import wandering_motion


@pytest.fixture(scope="module")
def dance() -> dict[str, Any]:
    return encode_motion(wandering_motion(2.0, 30.0, 3), ladder=(30.0, 5.0), grade="live").describe()


def test_the_dance_is_found_wherever_it_stands_and_what_is_not_known_is_skipped(dance: dict[str, Any]) -> None:
    tracks = Tracks([{"type": "smell"}, dance, {"type": "camera", "codec": "later"}, {"type": "audio"}])
    assert isinstance(tracks.store(1), BlockStore)
    assert tracks.store(1) is tracks.dance
    assert [tracks.store(number) for number in (0, 2, 3, 9)] == [None] * 4
    assert (tracks.scenes, tracks.sound, tracks.told) == ([], None, 4)
    assert tracks.kbps == [rate["kbps"] for rate in dance["rates"]]


def test_what_was_told_of_is_not_taken_in_again(dance: dict[str, Any]) -> None:
    tracks = Tracks([dance])
    kept = tracks.dance
    tracks.add(0, [dance, {"type": "smell"}])
    tracks.add(1, [{"type": "smell"}])
    assert (tracks.dance, tracks.told) == (kept, 2)


def test_performers_are_numbered_in_order_also_behind_one_that_cannot_be_shown(dance: dict[str, Any]) -> None:
    placed = dance | {"place": [1.0, -0.5, 2]}
    tracks = Tracks([dance, {"type": "camera", "codec": "later"}, placed])
    assert tracks.performers[0] is tracks.dance
    assert tracks.places == [MIDDLE, Place(1.0, -0.5, 2.0)]
    assert tracks.store(2) is tracks.performers[1] is not None
    tracks.add(3, [dance | {"codec": "later"}, dance | {"place": [0.0, 900.0, 0.0]}, dance])
    assert [store is not None for store in tracks.performers] == [True, True, False, False]
    assert tracks.store(5) is None


@pytest.mark.parametrize("described", [[], [{"type": "camera"}], [{"type": "motion", "codec": "later"}]])
def test_without_a_dance_there_is_nothing_to_show(described: list[dict[str, Any]]) -> None:
    with pytest.raises(DamagedBlock):
        Tracks(described)


def test_without_a_place_for_the_first_there_is_nothing_to_show(dance: dict[str, Any]) -> None:
    with pytest.raises(DamagedBlock, match="no place to dance at"):
        Tracks([dance | {"place": [0.0, 900.0, 0.0]}, dance])
