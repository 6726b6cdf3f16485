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
    target = LimbTarget(True, 0)
    target.set_start(START)
    return target


def add_input(
    target: LimbTarget, kind: InputKind, values: vector.Vector, sequence: int, sampled: int, received: int
) -> bool:
    return target.add_input(kind, values, sequence, sampled, received)


def test_velocity_moves_the_target_until_the_next_input() -> None:
    target = make_target()
    add_input(target, InputKind.VELOCITY, (0.5, 0.0, -1.0), 1, 0, 0)
    assert target.value_at(100_000) == pytest.approx((0.15, -0.5, 0.1))
    add_input(target, InputKind.VELOCITY, ZERO_VELOCITY, 2, 100_000, 100_000)
    assert target.value_at(200_000) == pytest.approx((0.15, -0.5, 0.1))


def test_targets_are_interpolated_linearly() -> None:
    target = make_target()
    for number in range(10):
        add_input(target, InputKind.TARGET, (0.01 * number, -0.5, 0.2), number, 16_000 * number, 16_000 * number)
    # from the ninth target, reached when the tenth is received, half the way to the tenth
    assert target.value_at(16_000 * 9) == pytest.approx((0.08, -0.5, 0.2))
    assert target.value_at(16_000 * 9 + 8_000) == pytest.approx((0.085, -0.5, 0.2))
    assert target.value_at(16_000 * 10) == (0.09, -0.5, 0.2)
    add_input(target, InputKind.TARGET, (0.5, -0.5, 0.2), 99, 900_000, 900_000)
    assert target.value_at(900_000 + MAX_TARGET_DURATION_US) == (0.5, -0.5, 0.2)


@given(st.integers(0, 10**12) | st.integers(-(10**12), 0), st.lists(st.integers(0, 60_000), min_size=8, max_size=8))
def test_offset_of_the_sender_clock_has_no_effect(skew: int, delays: list[int]) -> None:
    """Only differences of the sender's times count."""
    reference, skewed = make_target(), make_target()
    for target, offset in ((reference, 0), (skewed, skew)):
        for number, delay in enumerate(delays):
            sampled = 40_000 * number
            add_input(target, InputKind.VELOCITY, (0.1 * number, -0.3, 0.0), number, sampled + offset, sampled + delay)
    assert reference.value_at(10**6) == skewed.value_at(10**6)


def test_late_input_is_applied_from_its_sample_time() -> None:
    prompt, late = make_target(), make_target()
    for target, delay in ((prompt, 0), (late, 60_000)):
        add_input(target, InputKind.VELOCITY, ZERO_VELOCITY, 1, 0, 0)
        add_input(target, InputKind.VELOCITY, (1.0, 0.0, 0.0), 2, 50_000, 50_000 + delay)
        add_input(target, InputKind.VELOCITY, ZERO_VELOCITY, 3, 150_000, 150_000 + delay)
    assert late.value_at(240_000) == pytest.approx(prompt.value_at(240_000))


@given(st.permutations(range(6)))
def test_reordered_inputs_are_applied_by_sequence(order: list[int]) -> None:
    """Six inputs, sampled 20 ms apart, are received within 200 ms in any order."""
    inputs = [
        (InputKind.VELOCITY if number % 3 else InputKind.TARGET, (0.2, 0.1 * number - 0.3, -0.2)) for number in range(6)
    ]
    prompt, reordered = make_target(), make_target()
    # the first input has the least delay in both; delays are measured against it
    for target in (prompt, reordered):
        add_input(target, InputKind.VELOCITY, ZERO_VELOCITY, 0, 0, 0)
    for number, (kind, values) in enumerate(inputs):
        add_input(prompt, kind, values, number + 1, 20_000 * (number + 1), 20_000 * (number + 1))
    for position, number in enumerate(order):
        kind, values = inputs[number]
        add_input(reordered, kind, values, number + 1, 20_000 * (number + 1), 120_000 + 10_000 * position)
    assert reordered.value_at(200_000) == pytest.approx(prompt.value_at(200_000), abs=1e-9)


def test_duplicate_or_too_old_input_raises_late_input() -> None:
    target = make_target()
    for number in range(MAX_REORDERED_INPUTS + 3):
        add_input(target, InputKind.TARGET, (0.001 * number, 0.1, 0.1), number, number * 1_000, number * 1_000)
    value = target.value_at(10**6)
    for sequence in (MAX_REORDERED_INPUTS, 1):
        with pytest.raises(LateInput):
            add_input(target, InputKind.TARGET, ZERO_VELOCITY, sequence, 0, 90_000)
    assert target.value_at(10**6) == value


def test_silent_sender_holds_the_target_after_250_ms() -> None:
    target = make_target()
    add_input(target, InputKind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    held = target.value_at(HOLD_TIMEOUT_US)
    assert target.value_at(400_000) == held
    target.keep_alive(450_000)
    assert held is not None
    assert target.value_at(550_000) == pytest.approx((held[0] + 0.1, held[1], held[2]))


def test_stopped_target_is_constant() -> None:
    target = make_target()
    add_input(target, InputKind.VELOCITY, (0.0, 1.0, 0.0), 1, 0, 0)
    target.stop(50_000)
    assert target.value_at(50_000) == target.value_at(150_000) == pytest.approx((0.1, -0.45, 0.2))


def test_inputs_before_the_first_pose_apply_from_the_start() -> None:
    target = LimbTarget(True, 0)
    add_input(target, InputKind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    assert target.value_at(50_000) is None
    target.set_start(START)
    assert target.value_at(100_000) == pytest.approx((0.2, -0.5, 0.2))
    target.set_start(ZERO_VELOCITY)
    assert target.value_at(100_000) == pytest.approx((0.2, -0.5, 0.2))


@given(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3))
def test_target_is_clamped_to_reach_along_its_direction(requested: tuple[float, float, float]) -> None:
    target = make_target()
    is_within_reach = add_input(target, InputKind.TARGET, requested, 1, 5, 10)
    value = target.value_at(10**5)
    assert value is not None
    assert vector.length(value) <= 1.0 + 1e-12
    assert is_within_reach == (value == requested)
    max_component = max(abs(part) for part in requested)
    if max_component > 1e-3:
        expected = vector.unit(vector.scale(requested, 1.0 / max_component), START)
        assert vector.length(vector.subtract(vector.unit(value, START), expected)) < 1e-9


def test_leg_target_is_one_angle_within_its_limits() -> None:
    target = LimbTarget(False, 0)
    target.set_start(ZERO_VELOCITY)
    assert not add_input(target, InputKind.TARGET, (99.0, 3.0, 4.0), 1, 0, 0)
    assert target.value_at(0) == (MAX_THIGH_ANGLE_RAD, 0.0, 0.0)
    assert add_input(target, InputKind.VELOCITY, (-9.0, 1.0, 1.0), 2, 0, 0)
    assert target.value_at(100_000) == pytest.approx((MAX_THIGH_ANGLE_RAD - 0.2, 0.0, 0.0))
    assert not add_input(target, InputKind.TARGET, (-99.0, 0.0, 0.0), 3, 100_000, 100_000)
    assert target.value_at(200_000) == (MIN_THIGH_ANGLE_RAD, 0.0, 0.0)


@pytest.mark.parametrize("invalid", [nan, inf, -inf])
@pytest.mark.parametrize("kind", list(InputKind))
def test_non_finite_values_raise_value_error(invalid: float, kind: InputKind) -> None:
    target = make_target()
    with pytest.raises(ValueError, match="finite"):
        add_input(target, kind, (0.0, invalid, 0.0), 1, 0, 0)
    assert target.value_at(100_000) == START


def test_target_that_follows_starts_the_next_input_from_its_place() -> None:
    target = LimbTarget(is_hand=True, now=0)
    assert target.input_age_us(5) is None
    target.set_start((0.0, -0.5, 0.0))
    target.add_input(InputKind.VELOCITY, (1.0, 0.0, 0.0), 1, 0, 0)
    assert target.input_age_us(1_000_000) == 0
    target.add_input(InputKind.TARGET, (0.5, 0.0, 0.0), 2, 100_000, 100_000)
    assert target.input_age_us(150_000) == 50_000
    target.follow((0.0, 0.3, 0.3))
    assert target.value_at(160_000) == (0.0, 0.3, 0.3)
    for late in (1, 2):
        with pytest.raises(LateInput):
            target.add_input(InputKind.TARGET, (0.1, 0.1, 0.1), late, 170_000, 170_000)
    target.add_input(InputKind.VELOCITY, (1.0, 0.0, 0.0), 3, 200_000, 200_000)
    moved = target.value_at(300_000)
    assert moved is not None
    assert moved == pytest.approx((0.1, 0.3, 0.3))
