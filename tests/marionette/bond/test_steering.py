from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.bond.common_reach import Gap, Shell, ShellBorder
from bunraku.marionette.bond.steering import Wall, braking_speed, keep_within, limit_change, steer, wall_before
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import ZERO, Vector

FRAME_S = 1.0 / 60.0
MAX_CHANGE = 50.0 * FRAME_S
parts = st.floats(-1.8, 1.8)
vectors = st.tuples(parts, parts, parts)


@given(st.lists(vectors, min_size=1, max_size=8))
def test_point_in_a_still_shell_stays_there_at_a_bounded_acceleration(aims: list[Vector]) -> None:
    border = ShellBorder(Shell(ZERO, 0.15, 0.65), ZERO)
    point, velocity = (0.4, 0.0, 0.0), ZERO
    for aim in aims:
        for _ in range(12):
            steered = steer(point, velocity, aim, border, MAX_CHANGE, FRAME_S)
            assert vector.length(vector.subtract(steered, velocity)) <= MAX_CHANGE * (1.0 + 1e-9)
            point, velocity = vector.add(point, vector.scale(steered, FRAME_S)), steered
            assert max(border.shell.excesses(point)) < 5e-3


def test_point_without_a_border_near_takes_the_aim() -> None:
    border = ShellBorder(Shell(ZERO, 0.0, 100.0), ZERO)
    assert steer((1.0, 0.0, 0.0), ZERO, (0.3, 0.2, 0.1), border, MAX_CHANGE, FRAME_S) == (0.3, 0.2, 0.1)
    far = steer((1.0, 0.0, 0.0), ZERO, (30.0, 0.0, 0.0), border, MAX_CHANGE, FRAME_S)
    assert abs(far[0] - MAX_CHANGE) < 1e-12


def test_point_yields_to_a_border_that_approaches() -> None:
    velocity = ZERO
    for frame in range(60):
        # the border moves at 1 m/s and would pass the point after half a second
        shell = Shell((-frame * FRAME_S, 0.0, 0.0), 0.0, 1.0)
        border = ShellBorder(shell, (-1.0, 0.0, 0.0))
        if frame == 0:
            point = (0.5, 0.0, 0.0)
        before = velocity
        velocity = steer(point, velocity, ZERO, border, MAX_CHANGE, FRAME_S)
        assert vector.length(vector.subtract(velocity, before)) <= MAX_CHANGE
        point = vector.add(point, vector.scale(velocity, FRAME_S))
        assert shell.excesses(point)[0] < 1e-6
    assert velocity[0] < -0.9


@given(st.floats(0.0, 1.0))
def test_braking_speed_stops_within_the_distance(distance: float) -> None:
    left, speed = distance, braking_speed(distance, MAX_CHANGE, FRAME_S)
    while speed > 1e-9:
        left -= speed * FRAME_S
        next_speed = min(braking_speed(max(left, 0.0), MAX_CHANGE, FRAME_S), speed)
        # the last steps are somewhat steeper; walls are set with half of the acceleration
        assert speed - next_speed <= 1.25 * MAX_CHANGE
        speed = next_speed
    assert left >= -1e-9


def test_velocity_is_kept_within_several_walls() -> None:
    walls = [Wall((1.0, 0.0, 0.0), 0.2), Wall((0.0, 1.0, 0.0), -0.5), Wall((0.0, 0.0, 1.0), 9.0)]
    assert keep_within((3.0, 2.0, 1.0), walls) == pytest.approx((0.2, -0.5, 1.0))
    assert limit_change(ZERO, (3.0, 4.0, 0.0), 1.0) == (0.6000000000000001, 0.8, 0.0)
    assert limit_change(ZERO, (0.3, 0.4, 0.0), 1.0) == (0.3, 0.4, 0.0)


def test_wall_behind_a_point_demands_the_way_back() -> None:
    assert wall_before(Gap(-0.01, (1.0, 0.0, 0.0), 0.0), MAX_CHANGE, 0.01).speed == -1.0
