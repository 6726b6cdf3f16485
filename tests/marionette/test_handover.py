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


def test_the_weight_rises_in_150_ms_and_falls_in_350() -> None:
    taken = Handover()
    taken.advance(True, 0.075)
    assert abs(taken.weight - 0.5) < 1e-12
    taken.advance(True, 0.075)
    assert taken.weight == 1.0
    taken.advance(True, 5.0)
    taken.advance(False, 0.175)
    assert abs(taken.weight - 0.5) < 1e-12
    taken.advance(False, 0.176)
    assert taken.weight == 0.0


@given(st.floats(0.0, 0.6), st.floats(0.0, 3.0))
def test_the_way_home_takes_as_long_as_it_may(distance: float, speed: float) -> None:
    acceleration = return_acceleration(distance, speed, 1000.0)
    turned = distance + speed * speed / (2.0 * acceleration)
    seconds = speed / acceleration + 2.0 * sqrt(turned / acceleration)
    assert seconds <= RETURN_DURATION_S + 1e-3
    assert seconds >= RETURN_DURATION_S - 1e-2 or acceleration < 7.0
    assert return_acceleration(distance, speed, 20.0) <= 20.0


@given(hands, hands)
def test_a_turn_brings_one_direction_to_the_other(dance: Vector, pulled: Vector) -> None:
    turn = DirectionAlignment().update(dance, pulled, 0.5)
    along = vector.rotate(turn, vector.unit(dance, pulled))
    assert vector.length(vector.subtract(along, vector.unit(pulled, dance))) < 1e-6


@given(st.floats(-0.2, 0.2).filter(lambda aside: abs(aside) > 1e-3))
def test_hands_that_pass_opposite_each_other_do_not_throw_the_arm_round(aside: float) -> None:
    """By the shortest turn an elbow would be thrown across as they pass: half a circle within a frame or two."""
    way, before = DirectionAlignment(), None
    pulled = (0.0, -1.0, 0.0)
    for i in range(61):
        angle = 0.7 * pi + 0.01 * pi * i
        dance = vector.unit((aside, -cos(angle), sin(angle)), (0.0, 0.0, 1.0))
        side = vector.unit(vector.reject_from((1.0, 0.0, 0.0), dance), dance)
        shown = vector.rotate(way.update(dance, pulled, 0.999), side)
        if before is not None:
            assert vector.length(vector.subtract(shown, before)) < 0.15
        before = shown


@given(hands, st.lists(hands, min_size=1, max_size=12))
def test_a_hand_that_is_back_is_not_twisted(dance: Vector, way: list[Vector]) -> None:
    turn = DirectionAlignment()
    for place in way:
        turn.update(dance, place, 0.7)
    back = turn.update(dance, dance, 0.0)
    assert abs(abs(back[0]) - 1.0) < 1e-9


def test_joints_mix_exactly_at_the_ends() -> None:
    dance = (IDENTITY, IDENTITY, IDENTITY)
    half = vector.from_axis_angle((1.0, 0.0, 0.0), pi / 2.0)
    hung = (half, half, half)
    mix = JointBlend()
    assert mix.blend(dance, hung, 0.0) is dance
    quarter = vector.from_axis_angle((1.0, 0.0, 0.0), pi / 4.0)
    np.testing.assert_allclose(mix.blend(dance, hung, 0.5)[1], quarter, atol=1e-12)
    assert mix.blend(dance, hung, 1.0) is hung


def test_joints_that_come_to_be_opposite_are_not_thrown_across() -> None:
    mix, before = JointBlend(), None
    for step in range(60):
        turned = vector.from_axis_angle((1.0, 0.0, 0.0), 2.4 + 0.03 * step)
        joint = mix.blend((IDENTITY, IDENTITY, IDENTITY), (turned, turned, turned), 0.5)[0]
        if before is not None:
            assert abs(sum(a * b for a, b in zip(before, joint, strict=True))) > cos(0.02)
        before = joint
