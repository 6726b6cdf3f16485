from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import vector
from bunraku.marionette.leg import THIGH_GREATEST, THIGH_LEAST
from bunraku.marionette.steering import HOLD_AFTER, KEPT, LONGEST_WAY, Kind, Late, Steering

START = (0.1, -0.5, 0.2)
STOP = (0.0, 0.0, 0.0)


def hand() -> Steering:
    steering = Steering(True, 0)
    steering.begin(START)
    return steering


def give(steering: Steering, kind: Kind, values: vector.Vector, sequence: int, sampled: int, came: int) -> bool:
    return steering.input(kind, values, sequence, sampled, came)


def test_a_velocity_moves_until_the_next_input() -> None:
    steering = hand()
    give(steering, Kind.VELOCITY, (0.5, 0.0, -1.0), 1, 0, 0)
    assert steering.value(100_000) == pytest.approx((0.15, -0.5, 0.1))
    give(steering, Kind.VELOCITY, STOP, 2, 100_000, 100_000)
    assert steering.value(200_000) == pytest.approx((0.15, -0.5, 0.1))


def test_a_stream_of_targets_is_a_line_and_not_a_stair() -> None:
    steering = hand()
    for nth in range(10):
        give(steering, Kind.TARGET, (0.01 * nth, -0.5, 0.2), nth, 16_000 * nth, 16_000 * nth)
    # from the ninth place, where it was when the tenth was asked for, half the way to that
    assert steering.value(16_000 * 9) == pytest.approx((0.08, -0.5, 0.2))
    assert steering.value(16_000 * 9 + 8_000) == pytest.approx((0.085, -0.5, 0.2))
    assert steering.value(16_000 * 10) == (0.09, -0.5, 0.2)
    give(steering, Kind.TARGET, (0.5, -0.5, 0.2), 99, 900_000, 900_000)
    assert steering.value(900_000 + LONGEST_WAY) == (0.5, -0.5, 0.2)


@given(st.integers(0, 10**12) | st.integers(-(10**12), 0), st.lists(st.integers(0, 60_000), min_size=8, max_size=8))
def test_a_senders_clock_may_say_anything_as_long_as_it_runs(skew: int, delays: list[int]) -> None:
    """An hour off, or a day: only the differences count."""
    straight, skewed = hand(), hand()
    for steering, off in ((straight, 0), (skewed, skew)):
        for nth, delay in enumerate(delays):
            made = 40_000 * nth
            give(steering, Kind.VELOCITY, (0.1 * nth, -0.3, 0.0), nth, made + off, made + delay)
    assert straight.value(10**6) == skewed.value(10**6)


def test_an_input_that_comes_late_counts_from_when_it_was_made() -> None:
    prompt, late = hand(), hand()
    for steering, delay in ((prompt, 0), (late, 60_000)):
        give(steering, Kind.VELOCITY, STOP, 1, 0, 0)
        give(steering, Kind.VELOCITY, (1.0, 0.0, 0.0), 2, 50_000, 50_000 + delay)
        give(steering, Kind.VELOCITY, STOP, 3, 150_000, 150_000 + delay)
    assert late.value(240_000) == pytest.approx(prompt.value(240_000))


@given(st.permutations(range(6)))
def test_inputs_count_in_their_own_order(order: list[int]) -> None:
    """Six inputs made 20 ms apart; all have come after 200 ms, in any order."""
    inputs = [(Kind.VELOCITY if nth % 3 else Kind.TARGET, (0.2, 0.1 * nth - 0.3, -0.2)) for nth in range(6)]
    prompt, mixed = hand(), hand()
    # the first is the quickest in both: the others are told against it
    for steering in (prompt, mixed):
        give(steering, Kind.VELOCITY, STOP, 0, 0, 0)
    for nth, (kind, values) in enumerate(inputs):
        give(prompt, kind, values, nth + 1, 20_000 * (nth + 1), 20_000 * (nth + 1))
    for place, nth in enumerate(order):
        kind, values = inputs[nth]
        give(mixed, kind, values, nth + 1, 20_000 * (nth + 1), 120_000 + 10_000 * place)
    assert mixed.value(200_000) == pytest.approx(prompt.value(200_000), abs=1e-9)


def test_a_duplicate_and_one_that_is_too_old_do_not_count() -> None:
    steering = hand()
    for nth in range(KEPT + 3):
        give(steering, Kind.TARGET, (0.001 * nth, 0.1, 0.1), nth, nth * 1_000, nth * 1_000)
    here = steering.value(10**6)
    for sequence in (KEPT, 1):
        with pytest.raises(Late):
            give(steering, Kind.TARGET, STOP, sequence, 0, 90_000)
    assert steering.value(10**6) == here


def test_after_a_quarter_of_a_second_without_a_word_it_holds_still_until_the_next() -> None:
    steering = hand()
    give(steering, Kind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    held = steering.value(HOLD_AFTER)
    assert steering.value(400_000) == held
    steering.hear(450_000)
    assert held is not None
    assert steering.value(550_000) == pytest.approx((held[0] + 0.1, held[1], held[2]))


def test_a_stopped_limb_stays() -> None:
    steering = hand()
    give(steering, Kind.VELOCITY, (0.0, 1.0, 0.0), 1, 0, 0)
    steering.stop(50_000)
    assert steering.value(50_000) == steering.value(150_000) == pytest.approx((0.1, -0.45, 0.2))


def test_inputs_that_come_before_the_limb_was_seen_count_from_where_it_is() -> None:
    steering = Steering(True, 0)
    give(steering, Kind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    assert steering.value(50_000) is None
    steering.begin(START)
    assert steering.value(100_000) == pytest.approx((0.2, -0.5, 0.2))
    steering.begin(STOP)
    assert steering.value(100_000) == pytest.approx((0.2, -0.5, 0.2))


@given(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3))
def test_a_target_stays_within_reach_and_keeps_its_direction(target: tuple[float, float, float]) -> None:
    steering = hand()
    within = give(steering, Kind.TARGET, target, 1, 5, 10)
    value = steering.value(10**5)
    assert value is not None
    assert vector.length(value) <= 1.0 + 1e-12
    assert within == (value == target)
    largest = max(abs(part) for part in target)
    if largest > 1e-3:
        wanted = vector.unit(vector.scale(target, 1.0 / largest), START)
        assert vector.length(vector.subtract(vector.unit(value, START), wanted)) < 1e-9


def test_a_leg_has_one_number_and_its_limits() -> None:
    steering = Steering(False, 0)
    steering.begin(STOP)
    assert not give(steering, Kind.TARGET, (99.0, 3.0, 4.0), 1, 0, 0)
    assert steering.value(0) == (THIGH_GREATEST, 0.0, 0.0)
    assert give(steering, Kind.VELOCITY, (-9.0, 1.0, 1.0), 2, 0, 0)
    assert steering.value(100_000) == pytest.approx((THIGH_GREATEST - 0.2, 0.0, 0.0))
    assert not give(steering, Kind.TARGET, (-99.0, 0.0, 0.0), 3, 100_000, 100_000)
    assert steering.value(200_000) == (THIGH_LEAST, 0.0, 0.0)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize("kind", list(Kind))
def test_numbers_that_are_not_finite_are_refused_and_move_nothing(bad: float, kind: Kind) -> None:
    steering = hand()
    with pytest.raises(ValueError, match="finite"):
        give(steering, kind, (0.0, bad, 0.0), 1, 0, 0)
    assert steering.value(100_000) == START
