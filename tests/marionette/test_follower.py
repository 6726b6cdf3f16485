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
places = st.tuples(parts, parts, parts)


def velocity_change(follower: Follower, before: Vector) -> float:
    return vector.length(vector.subtract(follower.velocity, before)) / FRAME_S


@given(places, st.lists(st.tuples(places, st.integers(1, 20)), min_size=1, max_size=6))
def test_the_acceleration_is_bounded_whatever_is_wanted(start: Vector, ways: list[tuple[Vector, int]]) -> None:
    follower = Follower(start)
    for wanted, frames in ways:
        for _ in range(frames):
            before = follower.velocity
            follower.step(wanted, FRAME_S, MAX_ACCELERATION)
            assert velocity_change(follower, before) <= MAX_ACCELERATION * (1.0 + 1e-9)


@given(places, places)
def test_it_arrives_and_does_not_run_past(start: Vector, wanted: Vector) -> None:
    follower = Follower(start)
    distance = vector.length(vector.subtract(wanted, start))
    nearest = distance
    for _ in range(60):
        follower.step(wanted, FRAME_S, MAX_ACCELERATION)
        left = vector.length(vector.subtract(wanted, follower.position))
        assert left <= nearest + 1e-9
        assert vector.length(follower.velocity) <= MAX_LIMB_SPEED + 1e-9
        nearest = left
    assert nearest < 1e-9


def test_a_quarter_of_an_arm_takes_an_eighth_of_a_second() -> None:
    follower = Follower(ZERO)
    frames = 0
    while vector.length(vector.subtract(follower.position, (0.25, 0.0, 0.0))) > 0.01:
        follower.step((0.25, 0.0, 0.0), FRAME_S, MAX_ACCELERATION)
        frames += 1
    assert frames * FRAME_S <= 0.120


@given(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)))
def test_a_target_that_moves_evenly_is_kept_up_with(speed: Vector) -> None:
    follower = Follower((0.1, 0.2, 0.3))
    for frame in range(90):
        wanted = vector.add((0.1, 0.2, 0.3), vector.scale(speed, frame * FRAME_S))
        follower.step(wanted, FRAME_S, MAX_ACCELERATION)
        if frame > 60:
            assert vector.length(vector.subtract(follower.position, wanted)) < 1e-9


@given(places.filter(lambda v: vector.length(v) > 0.3), places.filter(lambda v: vector.length(v) > 0.3))
def test_the_way_goes_round_the_shoulder(start: Vector, wanted: Vector) -> None:
    follower = Follower(start)
    near = min(SHOULDER_CLEARANCE, vector.length(start), vector.length(wanted))
    for _ in range(120):
        follower.step(wanted, FRAME_S, MAX_ACCELERATION, min_distance=0.1, max_distance=1.3)
        assert vector.length(follower.position) >= min(near * 0.6, 0.1)
    assert vector.length(vector.subtract(follower.position, wanted)) < 1e-6


def test_on_moving_ground_it_is_back_in_time_whatever_the_ground_does() -> None:
    follower, before = Follower((0.5, 0.0, 0.0)), (0.0, 0.2, 0.0)
    for frame in range(1, 60):
        t = frame * FRAME_S
        ground = (0.1 * sin(20.0 * t), 0.2 * cos(10.0 * t), 0.0)
        carried = vector.scale(vector.subtract(ground, before), 1.0 / FRAME_S)
        follower.step(ground, FRAME_S, 30.0, frame_velocity=carried)
        before = ground
        if t > 0.45:
            assert vector.length(vector.subtract(follower.position, ground)) < 1e-9


@given(places, st.floats(0.02, 0.5), st.floats(0.5, 1.2))
def test_it_stays_within_the_shell(wanted: Vector, inner: float, outer: float) -> None:
    follower = Follower((0.0, -max(inner, 0.4), 0.0), (3.0, -2.0, 4.0))
    for _ in range(30):
        follower.step(wanted, FRAME_S, MAX_ACCELERATION, inner, outer)
        assert inner - 1e-9 <= vector.length(follower.position) <= max(outer, inner) + 1e-9


def test_no_time_moves_nothing() -> None:
    follower = Follower((0.1, 0.2, 0.3), (1.0, 0.0, 0.0))
    assert follower.step(ZERO, 0.0, MAX_ACCELERATION) == (0.1, 0.2, 0.3)
