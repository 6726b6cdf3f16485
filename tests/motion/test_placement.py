from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.placement import STAGE_CENTRE, Placement, place_in_row
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.vectors.blocks import random_motion

COORDINATES = st.floats(-6.0, 6.0)


def test_stage_centre_moves_nothing() -> None:
    motion = random_motion(0.3, 30.0, 3)
    root, rotations = STAGE_CENTRE.apply(motion.root, motion.rotations)
    assert root is motion.root
    assert rotations is motion.rotations


@given(COORDINATES, COORDINATES, COORDINATES)
def test_placement_rotates_from_z_towards_x_then_translates(x: float, z: float, turn: float) -> None:
    motion = random_motion(0.2, 30.0, 3)
    before = joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
    after = joint_and_tip_positions(motion.figure, *Placement(x, z, turn).apply(motion.root, motion.rotations))
    sine, cosine = np.sin(turn), np.cos(turn)
    np.testing.assert_allclose(after[..., 0], cosine * before[..., 0] + sine * before[..., 2] + x, atol=1e-9)
    np.testing.assert_allclose(after[..., 1], before[..., 1], atol=1e-9)
    np.testing.assert_allclose(after[..., 2], cosine * before[..., 2] - sine * before[..., 0] + z, atol=1e-9)


def test_single_pose_is_placed_like_many() -> None:
    motion = random_motion(0.2, 30.0, 4)
    place = Placement(1.0, -2.0, 0.7)
    root, rotations = place.apply(motion.root, motion.rotations)
    alone_root, alone_rotations = place.apply(motion.root[2], motion.rotations[2])
    np.testing.assert_allclose(alone_root, root[2])
    np.testing.assert_allclose(alone_rotations, rotations[2])


@pytest.mark.parametrize(
    ("said", "says"),
    [
        (None, "three numbers"),
        ([1.0, 2.0], "three numbers"),
        ([1.0, "left", 0.0], "finite"),
        ([1.0, float("nan"), 0.0], "finite"),
        ([0.0, 0.0, float("inf")], "finite"),
        ([100.5, 0.0, 0.0], "100 metres"),
        ([0.0, -100.5, 0.0], "100 metres"),
    ],
)
def test_invalid_placement_is_rejected(said: object, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Placement.parse(said)


def test_valid_placement_is_parsed() -> None:
    assert Placement.parse([1, -2.5, 0.25]) == Placement(1.0, -2.5, 0.25)
    assert Placement.parse(list(STAGE_CENTRE)) == STAGE_CENTRE


@given(st.lists(st.tuples(COORDINATES, COORDINATES, st.floats(0.5, 2.0), COORDINATES), min_size=1, max_size=4))
def test_row_has_the_given_gaps_and_is_centred(
    dances: list[tuple[float, ...]],
) -> None:
    middles = [np.array([x, z]) for x, z, _, _ in dances]
    apart, turns = [far for _, _, far, _ in dances[1:]], [turn for *_, turn in dances]
    places = place_in_row(middles, apart, turns)
    at = [
        place.apply(np.array([x, 0.9, z]), np.tile([1.0, 0.0, 0.0, 0.0], (18, 1)))[0]
        for place, (x, z) in zip(places, middles, strict=True)
    ]
    np.testing.assert_allclose([z for _, _, z in at], 0.0, atol=1e-9)
    assert at[0][0] + at[-1][0] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(np.diff([x for x, _, _ in at]), apart, atol=1e-9)
