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
from bunraku.marionette.solver import shoulder as shoulder_limit
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
def test_limits_hold_on_any_path_and_tip_is_exact_where_reachable(path: list[Vector]) -> None:
    elbow = started_elbow(RIG.target_direction(path[0]))
    for tip in path:
        for frame in range(10):
            pose = elbow.step(RIG.target_direction(tip), vector.length(tip), UP, FRAME_S)
            low, high = RIG.arm.bend_limits(min(vector.length(pose.tip), 1.0 - 1e-6))
            assert low - 1e-9 <= pose.bend <= high + 1e-9
            assert abs(vector.dot(pose.normal, RIG.target_direction(pose.tip))) < 1e-9
            shoulder, *bends = RIG.bend_joints(vector.length(pose.tip), pose.bend)
            chord = RIG.chord_frame(RIG.target_direction(pose.tip), pose.normal)
            positions = RIG.joint_positions((vector.multiply(chord, shoulder), bends[0], bends[1]))
            np.testing.assert_allclose(np.array(positions[2]) / RIG.arm_length_m, pose.tip, atol=1e-9)
            if frame == 9:
                assert shoulder_limit.depth_in_caps(RIG.shoulder, RIG.target_direction(positions[0])) <= 1e-6
        for _ in range(120):
            pose = elbow.step(RIG.target_direction(tip), vector.length(tip), UP, FRAME_S)
        if shoulder_limit.depth_in_caps(RIG.shoulder, RIG.target_direction(tip)) < -0.1:
            # in front of the body every position is reachable once the elbow has swung around
            np.testing.assert_allclose(pose.tip, tip, atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 300))
def test_slow_hand_moves_its_elbow_slowly(index: int) -> None:
    path = next(islice(slow_paths(MIN_REACH), index, None))
    step, _, depth = measure_elbow_steps(RIG, path)
    assert step <= 0.032
    assert depth <= 1e-6


def test_hand_at_rest_in_front_has_the_gravity_pose() -> None:
    tip = (0.2, -0.3, 0.5)
    elbow = started_elbow(RIG.target_direction(tip))
    for _ in range(300):
        pose = elbow.step(RIG.target_direction(tip), vector.length(tip), UP, FRAME_S)
    expected = vertical_normal(RIG.target_direction(tip), UP)
    assert expected is not None
    np.testing.assert_allclose(pose.normal, expected, atol=1e-6)
    reach = vector.length(tip)
    assert pose.bend == pytest.approx(RIG.arm.gravity_bend(reach, elevation(RIG.target_direction(tip), UP)), abs=1e-9)


def test_normal_is_constant_for_a_hand_straight_above() -> None:
    elbow = started_elbow(UP)
    before = elbow.step(UP, 0.7, UP, FRAME_S).normal
    for _ in range(60):
        after = elbow.step(UP, 0.7, UP, FRAME_S).normal
    np.testing.assert_allclose(after, before, atol=1e-12)


def test_hand_at_full_stretch_has_a_straight_arm() -> None:
    direction = vector.unit((0.3, -0.2, 0.9), UP)
    elbow = started_elbow(direction)
    for _ in range(60):
        pose = elbow.step(direction, MAX_REACH, UP, FRAME_S)
    shoulder, bend, _ = RIG.bend_joints(vector.length(pose.tip), pose.bend)
    assert bend[0] > 0.99
    assert shoulder is not None


@given(tips)
def test_elevation_lift_angle_and_vertical_normal(tip: Vector) -> None:
    direction = RIG.target_direction(tip)
    assert sin(elevation(direction, UP)) == pytest.approx(direction[1], abs=1e-9)
    assert lift_angle(vector.scale(direction, 3.0), direction) == pytest.approx(0.0, abs=1e-6)
    assert lift_angle(vector.any_perpendicular(direction), direction) == pytest.approx(pi / 2.0)
    assert vertical_normal(UP, UP) is None


def test_step_before_begin_raises_runtime_error() -> None:
    elbow = Elbow(RIG.arm, RIG.shoulder)
    assert not elbow.has_begun
    with pytest.raises(RuntimeError, match="begin"):
        elbow.step(UP, 0.5, UP, FRAME_S)
    elbow.begin(UP, (1.0, 0.0, 0.0), 0.2)
    states = [elbow.has_begun]
    elbow.reset()
    assert [*states, elbow.has_begun] == [True, False]


def test_preview_equals_the_next_step_and_has_no_effect() -> None:
    rig = ArmRig(standard_figure(), Limb.LEFT_HAND)
    elbow = Elbow(rig.arm, rig.shoulder)
    elbow.begin((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), 0.3)
    direction = vector.unit((0.5, 0.2, 0.6), (1.0, 0.0, 0.0))
    previews = [elbow.preview(direction, 0.8, (0.0, 1.0, 0.0), 0.02) for _ in range(2)]
    assert elbow.step(direction, 0.8, (0.0, 1.0, 0.0), 0.02) == previews[0] == previews[1]
