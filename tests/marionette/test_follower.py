from __future__ import annotations

from math import cos, sin

from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.constants import MAX_LIMB_SPEED, SHOULDER_CLEARANCE
from bunraku.marionette.follower import Follower
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import ZERO, Vector

FRAME_S = 1.0 / 60.0
MAX_ACCELERATION = 75.0
parts = st.floats(-0.7, 0.7)
positions = st.tuples(parts, parts, parts)


def velocity_change(follower: Follower, before: Vector) -> float:
    return vector.length(vector.subtract(follower.velocity, before)) / FRAME_S


@given(positions, st.lists(st.tuples(positions, st.integers(1, 20)), min_size=1, max_size=6))
def test_acceleration_is_bounded_for_any_targets(start: Vector, moves: list[tuple[Vector, int]]) -> None:
    follower = Follower(start)
    for target, frames in moves:
        for _ in range(frames):
            before = follower.velocity
            follower.step(target, FRAME_S, MAX_ACCELERATION)
            assert velocity_change(follower, before) <= MAX_ACCELERATION * (1.0 + 1e-9)


@given(positions, positions)
def test_follower_arrives_without_overshoot(start: Vector, target: Vector) -> None:
    follower = Follower(start)
    distance = vector.length(vector.subtract(target, start))
    least_remaining = distance
    for _ in range(60):
        follower.step(target, FRAME_S, MAX_ACCELERATION)
        remaining = vector.length(vector.subtract(target, follower.position))
        assert remaining <= least_remaining + 1e-9
        assert vector.length(follower.velocity) <= MAX_LIMB_SPEED + 1e-9
        least_remaining = remaining
    assert least_remaining < 1e-9


def test_quarter_of_an_arm_length_takes_at_most_120_ms() -> None:
    follower = Follower(ZERO)
    frames = 0
    while vector.length(vector.subtract(follower.position, (0.25, 0.0, 0.0))) > 0.01:
        follower.step((0.25, 0.0, 0.0), FRAME_S, MAX_ACCELERATION)
        frames += 1
    assert frames * FRAME_S <= 0.120


@given(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
def test_target_at_constant_velocity_is_followed_exactly(speed: Vector) -> None:
    follower = Follower((0.1, 0.2, 0.3))
    for frame in range(90):
        target = vector.add((0.1, 0.2, 0.3), vector.scale(speed, frame * FRAME_S))
        follower.step(target, FRAME_S, MAX_ACCELERATION)
        if frame > 60:
            assert vector.length(vector.subtract(follower.position, target)) < 1e-9


@given(positions.filter(lambda v: vector.length(v) > 0.3), positions.filter(lambda v: vector.length(v) > 0.3))
def test_path_avoids_the_shoulder(start: Vector, target: Vector) -> None:
    follower = Follower(start)
    clearance = min(SHOULDER_CLEARANCE, vector.length(start), vector.length(target))
    for _ in range(120):
        follower.step(target, FRAME_S, MAX_ACCELERATION, min_distance=0.1, max_distance=1.3)
        assert vector.length(follower.position) >= min(clearance * 0.6, 0.1)
    assert vector.length(vector.subtract(follower.position, target)) < 1e-6


def test_follower_reaches_a_moving_target_within_450_ms() -> None:
    follower, before = Follower((0.5, 0.0, 0.0)), (0.0, 0.2, 0.0)
    for frame in range(1, 60):
        t = frame * FRAME_S
        moving = (0.1 * sin(20.0 * t), 0.2 * cos(10.0 * t), 0.0)
        frame_velocity = vector.scale(vector.subtract(moving, before), 1.0 / FRAME_S)
        follower.step(moving, FRAME_S, 30.0, frame_velocity=frame_velocity)
        before = moving
        if t > 0.45:
            assert vector.length(vector.subtract(follower.position, moving)) < 1e-9


@given(positions, st.floats(0.02, 0.5), st.floats(0.5, 1.2))
def test_position_stays_between_min_and_max_distance(target: Vector, inner: float, outer: float) -> None:
    follower = Follower((0.0, -max(inner, 0.4), 0.0), (3.0, -2.0, 4.0))
    for _ in range(30):
        follower.step(target, FRAME_S, MAX_ACCELERATION, inner, outer)
        assert inner - 1e-9 <= vector.length(follower.position) <= max(outer, inner) + 1e-9


def test_step_of_zero_duration_moves_nothing() -> None:
    follower = Follower((0.1, 0.2, 0.3), (1.0, 0.0, 0.0))
    assert follower.step(ZERO, 0.0, MAX_ACCELERATION) == (0.1, 0.2, 0.3)


def test_follower_goes_on_from_where_it_was_moved_to() -> None:
    follower = Follower(ZERO)
    follower.step((0.5, 0.0, 0.0), FRAME_S, MAX_ACCELERATION)
    follower.move_to((0.1, 0.0, 0.0), FRAME_S)
    follower.move_to((0.12, 0.0, 0.0), FRAME_S)
    before = follower.velocity
    assert abs(before[0] - 0.02 / FRAME_S) < 1e-12
    follower.move_to((0.12, 0.0, 0.0), 0.0)
    assert follower.velocity == before
    follower.step((0.5, 0.0, 0.0), FRAME_S, MAX_ACCELERATION)
    assert velocity_change(follower, before) <= MAX_ACCELERATION * (1.0 + 1e-9)
