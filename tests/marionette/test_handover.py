from __future__ import annotations

from math import acos, cos, pi, sin

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import handover, vector
from bunraku.marionette.arm import Arm
from bunraku.marionette.handover import HandMix, Handover
from bunraku.marionette.table import table_of
from bunraku.marionette.vector import IDENTITY, Vector
from tests.marionette.arms import ARMS

ARM = Arm(ARMS[0], table_of(ARMS[0].identity))
FRAME = 1.0 / 60.0
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


def test_the_weight_rises_in_150_ms_and_falls_in_300() -> None:
    taken = Handover()
    taken.advance(True, 0.075)
    assert abs(taken.weight - 0.5) < 1e-12
    taken.advance(True, 0.075)
    assert taken.weight == 1.0
    taken.advance(True, 5.0)
    taken.advance(False, 0.150)
    assert abs(taken.weight - 0.5) < 1e-12
    taken.advance(False, 0.151)
    assert taken.weight == 0.0


@given(hands, hands)
def test_a_followed_hand_keeps_its_speed_and_arrives(hand: Vector, target: Vector) -> None:
    place = handover.follow_hand(hand, hand, ARM, FRAME)
    for _ in range(60):
        after = handover.follow_hand(place, target, ARM, FRAME)
        a, b = vector.unit(place, target), vector.unit(after, target)
        assert acos(min(1.0, vector.dot(a, b))) <= handover.TURN_SPEED * FRAME + 1e-6
        folded = abs(acos(vector.length(after)) - acos(vector.length(place)))
        assert folded <= handover.FOLD_SPEED * FRAME + 1e-9
        assert ARM.inner - 1e-12 <= vector.length(after) < 1.0
        place = after
    wanted = vector.scale(vector.unit(target, target), ARM.clamp(vector.length(target)))
    assert vector.length(vector.subtract(place, wanted)) < 1e-9


@given(hands, hands, st.floats(0.0, 1.0))
def test_a_mixed_hand_never_passes_through_the_shoulder(dance: Vector, pulled: Vector, weight: float) -> None:
    mixed, turn = HandMix().mix(dance, pulled, weight)
    near, far = sorted((vector.length(dance), vector.length(pulled)))
    assert near - 1e-9 <= vector.length(mixed) <= far + 1e-9
    assert HandMix().mix(dance, pulled, 0.0)[0] is dance
    assert HandMix().mix(dance, pulled, 1.0)[0] is pulled
    along = vector.rotate(turn, vector.unit(dance, mixed))
    assert vector.length(vector.subtract(along, vector.unit(mixed, along))) < 1e-6


@given(st.floats(-0.2, 0.2), st.floats(0.2, 0.8))
def test_hands_that_pass_opposite_each_other_do_not_change_the_way_round(aside: float, weight: float) -> None:
    """By the shortest way the mixed hand would jump by up to 2 pi times the smaller share as they pass."""
    way, before = HandMix(), None
    for i in range(61):
        angle = 0.7 * pi + 0.01 * pi * i
        dance = vector.unit((aside, -cos(angle), sin(angle)), (0.0, 0.0, 1.0))
        mixed, _ = way.mix(dance, (0.0, -1.0, 0.0), weight)
        if before is not None:
            assert vector.length(vector.subtract(mixed, before)) < 0.04
        before = mixed


def test_a_thigh_follows_and_joints_mix_exactly_at_the_ends() -> None:
    assert handover.follow_thigh(0.0, 0.1, FRAME) == 0.1
    assert handover.follow_thigh(0.0, -2.0, FRAME) == -handover.THIGH_SPEED * FRAME
    dance = (IDENTITY, IDENTITY, IDENTITY)
    half = vector.about((1.0, 0.0, 0.0), pi / 2.0)
    hung = (half, half, half)
    assert handover.mix_joints(dance, hung, 0.0) is dance
    assert handover.mix_joints(dance, hung, 1.0) is hung
    quarter = vector.about((1.0, 0.0, 0.0), pi / 4.0)
    np.testing.assert_allclose(handover.mix_joints(dance, hung, 0.5)[1], quarter, atol=1e-12)
