from __future__ import annotations

from itertools import islice
from math import pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.constants import MAX_REACH, MIN_REACH
from bunraku.marionette.elbow import Elbow
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.solver import shoulder as limit
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import elevation, lift_angle, vertical_normal
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.skeleton import standard_figure
from tests.bench.smoothness import measure_elbow_steps, slow_paths

RIG = ArmRig(standard_figure(), Limb.LEFT_HAND)
UP = (0.0, 1.0, 0.0)
FRAME_S = 1.0 / 60.0
parts = st.floats(-1.0, 1.0)
tips = st.tuples(parts, parts, parts).filter(lambda v: 0.15 < vector.length(v) < 0.99)


def started_elbow(direction: Vector) -> Elbow:
    elbow = Elbow(RIG.arm, RIG.shoulder)
    elbow.begin(direction, (-1.0, 0.0, 0.0), 0.3)
    return elbow


@settings(max_examples=50)
@given(st.lists(tips, min_size=1, max_size=12))
def test_limits_hold_on_any_way_and_the_tip_is_exact_wherever_a_shoulder_lets_it_be(way: list[Vector]) -> None:
    elbow = started_elbow(RIG.target_direction(way[0]))
    for tip in way:
        for frame in range(10):
            hanging = elbow.step(RIG.target_direction(tip), vector.length(tip), UP, FRAME_S)
            low, high = RIG.arm.bend_limits(min(vector.length(hanging.tip), 1.0 - 1e-6))
            assert low - 1e-9 <= hanging.bend <= high + 1e-9
            assert abs(vector.dot(hanging.normal, RIG.target_direction(hanging.tip))) < 1e-9
            shoulder, *others = RIG.bend_joints(vector.length(hanging.tip), hanging.bend)
            chord = RIG.chord_frame(RIG.target_direction(hanging.tip), hanging.normal)
            places = RIG.joint_positions((vector.multiply(chord, shoulder), others[0], others[1]))
            np.testing.assert_allclose(np.array(places[2]) / RIG.arm_length_m, hanging.tip, atol=1e-9)
            if frame == 9:
                assert limit.depth_in_caps(RIG.shoulder, RIG.target_direction(places[0])) <= 1e-6
        for _ in range(120):
            hanging = elbow.step(RIG.target_direction(tip), vector.length(tip), UP, FRAME_S)
        if limit.depth_in_caps(RIG.shoulder, RIG.target_direction(tip)) < -0.1:
            # in front of the body an arm reaches every place once its elbow has come round
            np.testing.assert_allclose(hanging.tip, tip, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 300))
def test_the_elbow_of_a_slow_hand_moves_little(nth: int) -> None:
    path = next(islice(slow_paths(MIN_REACH), nth, None))
    step, _, depth = measure_elbow_steps(RIG, path)
    assert step <= 0.032
    assert depth <= 1e-6


def test_a_hand_that_rests_in_front_has_gravitys_arm() -> None:
    tip = (0.2, -0.3, 0.5)
    elbow = started_elbow(RIG.target_direction(tip))
    for _ in range(300):
        hanging = elbow.step(RIG.target_direction(tip), vector.length(tip), UP, FRAME_S)
    wanted = vertical_normal(RIG.target_direction(tip), UP)
    assert wanted is not None
    np.testing.assert_allclose(hanging.normal, wanted, atol=1e-6)
    reach = vector.length(tip)
    assert hanging.bend == pytest.approx(
        RIG.arm.gravity_bend(reach, elevation(RIG.target_direction(tip), UP)), abs=1e-9
    )


def test_straight_above_the_plane_stays_and_a_little_beside_it_swings() -> None:
    elbow = started_elbow(UP)
    before = elbow.step(UP, 0.7, UP, FRAME_S).normal
    for _ in range(60):
        after = elbow.step(UP, 0.7, UP, FRAME_S).normal
    np.testing.assert_allclose(after, before, atol=1e-12)


def test_a_hand_at_full_stretch_has_a_straight_arm() -> None:
    direction = vector.unit((0.3, -0.2, 0.9), UP)
    elbow = started_elbow(direction)
    for _ in range(60):
        hanging = elbow.step(direction, MAX_REACH, UP, FRAME_S)
    shoulder, bend, _ = RIG.bend_joints(vector.length(hanging.tip), hanging.bend)
    assert bend[0] > 0.99
    assert shoulder is not None


@given(tips)
def test_small_measures(tip: Vector) -> None:
    direction = RIG.target_direction(tip)
    assert sin(elevation(direction, UP)) == pytest.approx(direction[1], abs=1e-9)
    assert lift_angle(vector.scale(direction, 3.0), direction) == pytest.approx(0.0, abs=1e-6)
    assert lift_angle(vector.any_perpendicular(direction), direction) == pytest.approx(pi / 2.0)
    assert vertical_normal(UP, UP) is None


def test_it_follows_once_it_has_begun() -> None:
    elbow = Elbow(RIG.arm, RIG.shoulder)
    assert not elbow.has_begun
    with pytest.raises(RuntimeError, match="begin"):
        elbow.step(UP, 0.5, UP, FRAME_S)
    elbow.begin(UP, (1.0, 0.0, 0.0), 0.2)
    known = [elbow.has_begun]
    elbow.reset()
    assert [*known, elbow.has_begun] == [True, False]
