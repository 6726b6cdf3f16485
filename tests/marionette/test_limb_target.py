from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.constants import MAX_TARGET_DURATION_US, MAX_THIGH_ANGLE_RAD, MIN_THIGH_ANGLE_RAD
from bunraku.marionette.limb_target import HOLD_TIMEOUT_US, MAX_REORDERED_INPUTS, InputKind, LateInput, LimbTarget
from bunraku.marionette.solver import vector

START = (0.1, -0.5, 0.2)
ZERO_VELOCITY = (0.0, 0.0, 0.0)


def make_target() -> LimbTarget:
    steering = LimbTarget(True, 0)
    steering.set_start(START)
    return steering


def add_input(
    steering: LimbTarget, kind: InputKind, values: vector.Vector, sequence: int, sampled: int, came: int
) -> bool:
    return steering.add_input(kind, values, sequence, sampled, came)


def test_a_velocity_moves_until_the_next_input() -> None:
    steering = make_target()
    add_input(steering, InputKind.VELOCITY, (0.5, 0.0, -1.0), 1, 0, 0)
    assert steering.value_at(100_000) == pytest.approx((0.15, -0.5, 0.1))
    add_input(steering, InputKind.VELOCITY, ZERO_VELOCITY, 2, 100_000, 100_000)
    assert steering.value_at(200_000) == pytest.approx((0.15, -0.5, 0.1))


def test_a_stream_of_targets_is_a_line_and_not_a_stair() -> None:
    steering = make_target()
    for nth in range(10):
        add_input(steering, InputKind.TARGET, (0.01 * nth, -0.5, 0.2), nth, 16_000 * nth, 16_000 * nth)
    # from the ninth place, where it was when the tenth was asked for, half the way to that
    assert steering.value_at(16_000 * 9) == pytest.approx((0.08, -0.5, 0.2))
    assert steering.value_at(16_000 * 9 + 8_000) == pytest.approx((0.085, -0.5, 0.2))
    assert steering.value_at(16_000 * 10) == (0.09, -0.5, 0.2)
    add_input(steering, InputKind.TARGET, (0.5, -0.5, 0.2), 99, 900_000, 900_000)
    assert steering.value_at(900_000 + MAX_TARGET_DURATION_US) == (0.5, -0.5, 0.2)


@given(st.integers(0, 10**12) | st.integers(-(10**12), 0), st.lists(st.integers(0, 60_000), min_size=8, max_size=8))
def test_a_senders_clock_may_say_anything_as_long_as_it_runs(skew: int, delays: list[int]) -> None:
    """An hour off, or a day: only the differences count."""
    straight, skewed = make_target(), make_target()
    for steering, off in ((straight, 0), (skewed, skew)):
        for nth, delay in enumerate(delays):
            made = 40_000 * nth
            add_input(steering, InputKind.VELOCITY, (0.1 * nth, -0.3, 0.0), nth, made + off, made + delay)
    assert straight.value_at(10**6) == skewed.value_at(10**6)


def test_an_input_that_comes_late_counts_from_when_it_was_made() -> None:
    prompt, late = make_target(), make_target()
    for steering, delay in ((prompt, 0), (late, 60_000)):
        add_input(steering, InputKind.VELOCITY, ZERO_VELOCITY, 1, 0, 0)
        add_input(steering, InputKind.VELOCITY, (1.0, 0.0, 0.0), 2, 50_000, 50_000 + delay)
        add_input(steering, InputKind.VELOCITY, ZERO_VELOCITY, 3, 150_000, 150_000 + delay)
    assert late.value_at(240_000) == pytest.approx(prompt.value_at(240_000))


@given(st.permutations(range(6)))
def test_inputs_count_in_their_own_order(order: list[int]) -> None:
    """Six inputs made 20 ms apart; all have come after 200 ms, in any order."""
    inputs = [(InputKind.VELOCITY if nth % 3 else InputKind.TARGET, (0.2, 0.1 * nth - 0.3, -0.2)) for nth in range(6)]
    prompt, mixed = make_target(), make_target()
    # the first is the quickest in both: the others are told against it
    for steering in (prompt, mixed):
        add_input(steering, InputKind.VELOCITY, ZERO_VELOCITY, 0, 0, 0)
    for nth, (kind, values) in enumerate(inputs):
        add_input(prompt, kind, values, nth + 1, 20_000 * (nth + 1), 20_000 * (nth + 1))
    for place, nth in enumerate(order):
        kind, values = inputs[nth]
        add_input(mixed, kind, values, nth + 1, 20_000 * (nth + 1), 120_000 + 10_000 * place)
    assert mixed.value_at(200_000) == pytest.approx(prompt.value_at(200_000), abs=1e-9)


def test_a_duplicate_and_one_that_is_too_old_do_not_count() -> None:
    steering = make_target()
    for nth in range(MAX_REORDERED_INPUTS + 3):
        add_input(steering, InputKind.TARGET, (0.001 * nth, 0.1, 0.1), nth, nth * 1_000, nth * 1_000)
    here = steering.value_at(10**6)
    for sequence in (MAX_REORDERED_INPUTS, 1):
        with pytest.raises(LateInput):
            add_input(steering, InputKind.TARGET, ZERO_VELOCITY, sequence, 0, 90_000)
    assert steering.value_at(10**6) == here


def test_after_a_quarter_of_a_second_without_a_word_it_holds_still_until_the_next() -> None:
    steering = make_target()
    add_input(steering, InputKind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    held = steering.value_at(HOLD_TIMEOUT_US)
    assert steering.value_at(400_000) == held
    steering.keep_alive(450_000)
    assert held is not None
    assert steering.value_at(550_000) == pytest.approx((held[0] + 0.1, held[1], held[2]))


def test_a_stopped_limb_stays() -> None:
    steering = make_target()
    add_input(steering, InputKind.VELOCITY, (0.0, 1.0, 0.0), 1, 0, 0)
    steering.stop(50_000)
    assert steering.value_at(50_000) == steering.value_at(150_000) == pytest.approx((0.1, -0.45, 0.2))


def test_inputs_that_come_before_the_limb_was_seen_count_from_where_it_is() -> None:
    steering = LimbTarget(True, 0)
    add_input(steering, InputKind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    assert steering.value_at(50_000) is None
    steering.set_start(START)
    assert steering.value_at(100_000) == pytest.approx((0.2, -0.5, 0.2))
    steering.set_start(ZERO_VELOCITY)
    assert steering.value_at(100_000) == pytest.approx((0.2, -0.5, 0.2))


@given(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3))
def test_a_target_stays_within_reach_and_keeps_its_direction(target: tuple[float, float, float]) -> None:
    steering = make_target()
    within = add_input(steering, InputKind.TARGET, target, 1, 5, 10)
    value = steering.value_at(10**5)
    assert value is not None
    assert vector.length(value) <= 1.0 + 1e-12
    assert within == (value == target)
    largest = max(abs(part) for part in target)
    if largest > 1e-3:
        wanted = vector.unit(vector.scale(target, 1.0 / largest), START)
        assert vector.length(vector.subtract(vector.unit(value, START), wanted)) < 1e-9


def test_a_leg_has_one_number_and_its_limits() -> None:
    steering = LimbTarget(False, 0)
    steering.set_start(ZERO_VELOCITY)
    assert not add_input(steering, InputKind.TARGET, (99.0, 3.0, 4.0), 1, 0, 0)
    assert steering.value_at(0) == (MAX_THIGH_ANGLE_RAD, 0.0, 0.0)
    assert add_input(steering, InputKind.VELOCITY, (-9.0, 1.0, 1.0), 2, 0, 0)
    assert steering.value_at(100_000) == pytest.approx((MAX_THIGH_ANGLE_RAD - 0.2, 0.0, 0.0))
    assert not add_input(steering, InputKind.TARGET, (-99.0, 0.0, 0.0), 3, 100_000, 100_000)
    assert steering.value_at(200_000) == (MIN_THIGH_ANGLE_RAD, 0.0, 0.0)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize("kind", list(InputKind))
def test_numbers_that_are_not_finite_are_refused_and_move_nothing(bad: float, kind: InputKind) -> None:
    steering = make_target()
    with pytest.raises(ValueError, match="finite"):
        add_input(steering, kind, (0.0, bad, 0.0), 1, 0, 0)
    assert steering.value_at(100_000) == START
