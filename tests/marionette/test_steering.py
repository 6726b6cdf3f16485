from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import vector
from bunraku.marionette.leg import THIGH_GREATEST, THIGH_LEAST
from bunraku.marionette.limbs import Limb
from bunraku.marionette.steering import HOLD_AFTER, Steering

START = (0.1, -0.5, 0.2)


def hand() -> Steering:
    steering = Steering(Limb.LEFT_HAND, 0)
    steering.begin(START, 0)
    return steering


def test_a_velocity_moves_until_the_next_input() -> None:
    steering = hand()
    steering.velocity((0.5, 0.0, -1.0), 0, 0)
    steering.advance(100_000)
    assert steering.value == pytest.approx((0.15, -0.5, 0.1))
    steering.velocity((0.0, 0.0, 0.0), 100_000, 100_000)
    steering.advance(200_000)
    assert steering.value == pytest.approx((0.15, -0.5, 0.1))


def test_an_input_that_comes_late_counts_from_when_it_was_sampled() -> None:
    prompt, late = hand(), hand()
    for steering, delay in ((prompt, 0), (late, 60_000)):
        steering.velocity((1.0, 0.0, 0.0), 0, delay)
        steering.advance(100_000)
        steering.velocity((0.0, 0.0, 0.0), 100_000, 100_000 + delay)
        steering.advance(240_000)
    assert late.value == pytest.approx(prompt.value)


def test_after_a_quarter_of_a_second_without_a_word_it_holds_still_until_the_next() -> None:
    steering = hand()
    steering.velocity((1.0, 0.0, 0.0), 0, 0)
    steering.advance(HOLD_AFTER)
    held = steering.value
    steering.advance(400_000)
    assert steering.value == held
    steering.hear(450_000)
    steering.advance(550_000)
    assert held is not None
    assert steering.value == pytest.approx((held[0] + 0.1, held[1], held[2]))


def test_a_stopped_limb_stays() -> None:
    steering = hand()
    steering.velocity((0.0, 1.0, 0.0), 0, 0)
    steering.stop(50_000)
    here = steering.value
    steering.advance(150_000)
    assert steering.value == here == pytest.approx((0.1, -0.45, 0.2))


@given(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3))
def test_a_target_stays_within_reach_and_keeps_its_direction(target: tuple[float, float, float]) -> None:
    steering = hand()
    steering.target(target, 5, 10)
    assert steering.value is not None
    assert vector.length(steering.value) <= 1.0 + 1e-12
    largest = max(abs(part) for part in target)
    if largest > 1e-3:
        wanted = vector.unit(vector.scale(target, 1.0 / largest), START)
        assert vector.length(vector.subtract(vector.unit(steering.value, START), wanted)) < 1e-9


def test_a_leg_has_one_number_and_its_limits() -> None:
    steering = Steering(Limb.RIGHT_LEG, 0)
    steering.target((99.0, 3.0, 4.0), 0, 0)
    assert steering.value == (THIGH_GREATEST, 0.0, 0.0)
    steering.velocity((-9.0, 1.0, 1.0), 0, 0)
    steering.advance(100_000)
    assert steering.value == pytest.approx((THIGH_GREATEST - 0.2, 0.0, 0.0))
    steering.target((-99.0, 0.0, 0.0), 100_000, 100_000)
    assert steering.value == (THIGH_LEAST, 0.0, 0.0)


def test_a_clock_ahead_of_ours_or_far_behind_moves_nothing_more() -> None:
    steering = hand()
    steering.advance(1_000_000)
    steering.velocity((1.0, 0.0, 0.0), -(10**15), 1_000_000)
    assert steering.value == pytest.approx((START[0] + HOLD_AFTER * 1e-6, START[1], START[2]))
    steering.velocity((0.0, 0.0, 0.0), 10**15, 1_000_000)
    assert steering.value == pytest.approx((START[0] + HOLD_AFTER * 1e-6, START[1], START[2]))


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_numbers_that_are_not_finite_are_refused_and_move_nothing(bad: float) -> None:
    steering = hand()
    with pytest.raises(ValueError, match="finite"):
        steering.target((0.0, bad, 0.0), 0, 0)
    with pytest.raises(ValueError, match="finite"):
        steering.velocity((0.0, bad, 0.0), 0, 0)
    steering.advance(100_000)
    assert steering.value == START
