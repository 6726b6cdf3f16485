from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import handover
from bunraku.marionette.constants import RETURN_DURATION_S
from bunraku.marionette.handover import DirectionAlignment, Handover, JointBlend, return_acceleration
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import IDENTITY, Vector

parts = st.floats(-1.0, 1.0)
hands = st.tuples(parts, parts, parts).filter(lambda v: vector.length(v) > 0.05)


def test_minimum_jerk_starts_and_ends_at_rest() -> None:
    x = np.linspace(0.0, 1.0, 2001)
    y = np.array([handover.minimum_jerk(float(value)) for value in x])
    assert y[0] == 0.0
    assert abs(y[-1] - 1.0) < 1e-12
    assert (np.diff(y) >= -1e-15).all()
    speed = np.gradient(y, x)
    assert abs(speed[0]) < 1e-4
    assert abs(speed[-1]) < 1e-4
    assert abs(np.gradient(speed, x)[1]) < 0.1


def test_weight_rises_in_150_ms_and_falls_in_350_ms() -> None:
    state = Handover()
    state.advance(True, 0.075)
    assert abs(state.weight - 0.5) < 1e-12
    state.advance(True, 0.075)
    assert state.weight == 1.0
    state.advance(True, 5.0)
    state.advance(False, 0.175)
    assert abs(state.weight - 0.5) < 1e-12
    state.advance(False, 0.176)
    assert state.weight == 0.0


@given(st.floats(0.0, 0.6), st.floats(0.0, 3.0))
def test_return_takes_at_most_the_return_duration(distance: float, speed: float) -> None:
    acceleration = return_acceleration(distance, speed, 1000.0)
    farthest_distance = distance + speed * speed / (2.0 * acceleration)
    seconds = speed / acceleration + 2.0 * sqrt(farthest_distance / acceleration)
    assert seconds <= RETURN_DURATION_S + 1e-3
    assert seconds >= RETURN_DURATION_S - 1e-2 or acceleration < 7.0
    assert return_acceleration(distance, speed, 20.0) <= 20.0


@given(hands, hands)
def test_alignment_rotates_one_direction_to_the_other(motion: Vector, controlled: Vector) -> None:
    turn = DirectionAlignment().update(motion, controlled, 0.5)
    rotated = vector.rotate(turn, vector.unit(motion, controlled))
    assert vector.length(vector.subtract(rotated, vector.unit(controlled, motion))) < 1e-6


@given(st.floats(-0.2, 0.2).filter(lambda offset: abs(offset) > 1e-3))
def test_alignment_is_continuous_when_hands_pass_opposite_each_other(offset: float) -> None:
    """The shortest rotation would turn the elbow by half a circle within a frame or two."""
    alignment, before = DirectionAlignment(), None
    controlled = (0.0, -1.0, 0.0)
    for i in range(61):
        angle = 0.7 * pi + 0.01 * pi * i
        motion = vector.unit((offset, -cos(angle), sin(angle)), (0.0, 0.0, 1.0))
        side = vector.unit(vector.reject_from((1.0, 0.0, 0.0), motion), motion)
        shown = vector.rotate(alignment.update(motion, controlled, 0.999), side)
        if before is not None:
            assert vector.length(vector.subtract(shown, before)) < 0.15
        before = shown


@given(hands, st.lists(hands, min_size=1, max_size=12))
def test_alignment_of_equal_directions_is_the_identity(motion: Vector, directions: list[Vector]) -> None:
    turn = DirectionAlignment()
    for direction in directions:
        turn.update(motion, direction, 0.7)
    aligned = turn.update(motion, motion, 0.0)
    assert abs(abs(aligned[0]) - 1.0) < 1e-9


def test_joint_blend_is_exact_at_weights_zero_and_one() -> None:
    motion = (IDENTITY, IDENTITY, IDENTITY)
    half = vector.from_axis_angle((1.0, 0.0, 0.0), pi / 2.0)
    solved = (half, half, half)
    joint_blend = JointBlend()
    assert joint_blend.blend(motion, solved, 0.0) is motion
    quarter = vector.from_axis_angle((1.0, 0.0, 0.0), pi / 4.0)
    np.testing.assert_allclose(joint_blend.blend(motion, solved, 0.5)[1], quarter, atol=1e-12)
    assert joint_blend.blend(motion, solved, 1.0) is solved


def test_joint_blend_is_continuous_through_opposite_rotations() -> None:
    joint_blend, before = JointBlend(), None
    for step in range(60):
        rotated = vector.from_axis_angle((1.0, 0.0, 0.0), 2.4 + 0.03 * step)
        joint = joint_blend.blend((IDENTITY, IDENTITY, IDENTITY), (rotated, rotated, rotated), 0.5)[0]
        if before is not None:
            assert abs(sum(a * b for a, b in zip(before, joint, strict=True))) > cos(0.02)
        before = joint
