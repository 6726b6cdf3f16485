from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bunraku.backing import library
from bunraku.backing.library import StoredMotion
from bunraku.codec.decode import decode_block
from bunraku.codec.encode import encode_motion
from bunraku.ingest.gathering import ROAMING, ROOM, gather, side_by_side
from bunraku.ingest.results import Made, Refused
from bunraku.motion import rotation
from bunraku.motion.place import Place
from bunraku.motion.skeleton import Motion
from bunraku.wire.messages import Data
from tests.ingest.dances import DANCES
from tests.vectors.blocks import wandering_motion


def walking(name: str, metres: float, facing: float) -> StoredMotion:
    """A dance that goes `metres` to its left and back, about (3, -2), and faces `facing`."""
    motion = wandering_motion(2.0, 30.0, 31)
    turn = rotation.about_axis(1, np.full(60, facing))
    along = rotation.rotate(
        turn, np.stack([np.interp(range(60), (0, 30, 59), (0, metres, 0)), np.zeros(60), np.zeros(60)], 1)
    )
    rotations = motion.rotations.copy()
    rotations[:, 0] = turn
    walked = Motion(motion.figure, 30.0, along + np.array([3.0, 0.9, -2.0]), rotations)
    return library.unpack(name, library.pack(name, encode_motion(walked, ladder=(30.0, 5.0), grade="live")))


def on_stage(motion: StoredMotion) -> list[np.ndarray]:
    """Of each performer the root's places, (frames, 3)."""
    found = []
    for dance in motion.dances:
        packets = enumerate(dance.packets[-1])
        blocks = [
            decode_block(dance.track, Data.unpack(packet).block).at(np.arange(float(dance.track.frames_in(index))))
            for index, packet in packets
        ]
        root, rotations = (np.concatenate(part) for part in zip(*blocks, strict=True))
        root, rotations = dance.place.bring(root, rotations)
        forward = rotation.rotate(rotations[:, 0], np.array([0.0, 0.0, 1.0])).mean(axis=0)
        assert np.arctan2(forward[0], forward[2]) == pytest.approx(0.0, abs=0.05)
        found.append(root)
    return found


def test_they_stand_in_a_row_as_near_as_their_dances_let_them_and_face_one_way() -> None:
    still, wide = walking("still", 0.0, 2.0), walking("wide", 1.5, -1.0)
    made = gather("three", still, [wide, still], None)
    assert isinstance(made, Made)
    assert made.described == {"tracks": ["motion"] * 3, "performers": 3, "made_from": "still"}
    roots = on_stage(library.unpack("three", made.packed))
    for left, right in pairwise(roots):
        assert (right[:, 0] - left[:, 0]).min() == pytest.approx(ROOM, abs=0.15)
    middles = [(root[:, 0].min() + root[:, 0].max()) / 2 for root in roots]
    assert middles[0] + middles[2] == pytest.approx(0.0, abs=0.1)
    for root in roots:
        assert abs(root[:, 2]).max() < 0.1


def test_who_dance_the_same_keep_step_side_by_side() -> None:
    wide = walking("wide", 3.0, 1.0)
    made = gather("two", wide, [wide], None)
    assert isinstance(made, Made)
    left, right = on_stage(library.unpack("two", made.packed))
    assert right[:, 0] - left[:, 0] == pytest.approx(ROOM, abs=1e-6)


def test_who_walks_across_the_floor_is_not_given_all_of_it() -> None:
    far, still = walking("far", 30.0, 0.0), walking("still", 0.0, 0.0)
    left, right = side_by_side([far.dances[0], still.dances[0]])
    middles = [place.x + 3.0 + half for place, half in ((left, 15.0), (right, 0.0))]
    assert middles[1] - middles[0] == pytest.approx(ROOM + ROAMING, abs=0.6)


def test_places_may_be_given_and_there_are_as_many_as_performers() -> None:
    places = [Place(0.0, 1.0, 0.0), Place(0.5, -1.0, 3.0)]
    made = gather("m", DANCES["one"], [DANCES["two"]], places)
    assert isinstance(made, Made)
    assert [dance.place for dance in library.unpack("m", made.packed).dances] == places
    refused = gather("m", DANCES["one"], [DANCES["both"]], places)
    assert isinstance(refused, Refused)
    assert refused.field == "places"


def test_more_than_four_are_refused() -> None:
    refused = gather("m", DANCES["both"], [DANCES["both"], DANCES["one"]], None)
    assert isinstance(refused, Refused)
    assert (refused.title, refused.field) == ("Too many performers", "motions")
    assert "this would have 5" in refused.detail


def test_it_says_how_far_it_is() -> None:
    told: list[float] = []
    gather("m", DANCES["one"], [DANCES["two"]], None, told.append)
    assert told == [0.5, 1.0]
