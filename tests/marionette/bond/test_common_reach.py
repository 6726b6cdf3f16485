from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from bunraku.marionette.bond.common_reach import TOLERANCE, CommonBorder, Shell, ShellBorder, nearest_common_point
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import ZERO, Vector

parts = st.floats(-1.2, 1.2)
points = st.tuples(parts, parts, parts)
shells = st.builds(Shell, points, st.floats(0.05, 0.2), st.floats(0.5, 0.8))


@given(points, shells, shells)
def test_nearest_common_point_is_in_both_shells(point: Vector, first: Shell, second: Shell) -> None:
    nearest = nearest_common_point(point, first, second)
    if nearest is None:
        distance = vector.length(vector.subtract(first.centre, second.centre))
        assert distance > first.outer + second.outer - 1e-6
    else:
        assert first.contains(nearest)
        assert second.contains(nearest)


@given(points, shells, shells, st.integers(0, 1000))
def test_no_other_common_point_is_nearer(point: Vector, first: Shell, second: Shell, seed: int) -> None:
    nearest = nearest_common_point(point, first, second)
    assume(nearest is not None)
    assert nearest is not None
    least = vector.length(vector.subtract(nearest, point))
    for offset in np.random.default_rng(seed).normal(scale=0.5, size=(200, 3)).tolist():
        other = first.nearest(vector.add(nearest, (offset[0], offset[1], offset[2])))
        if second.contains(other):
            assert vector.length(vector.subtract(other, point)) >= least - 1e-7


@given(points, points)
def test_gap_of_a_moving_shell_is_its_distance_in_a_moment(point: Vector, drift: Vector) -> None:
    shell = Shell((0.1, 0.2, 0.3), 0.1, 0.7)
    assume(vector.length(vector.subtract(point, shell.centre)) > 0.05)
    moment = 1e-6
    later = shell._replace(centre=vector.add(shell.centre, vector.scale(drift, moment)))
    for now, then in zip(ShellBorder(shell, drift).gaps(point), ShellBorder(later, drift).gaps(point), strict=True):
        assert abs(then.distance - now.distance - now.retreat * moment) < 1e-9


@given(points, points, st.floats(-2.0, 2.0))
def test_gap_of_the_rim_follows_both_shells(point: Vector, drift: Vector, apart: float) -> None:
    first, second = Shell(ZERO, 0.1, 0.65), Shell((0.8, 0.1, -0.2), 0.1, 0.6)
    axis = vector.unit(second.centre, ZERO)
    assume(vector.length(vector.reject_from(point, axis)) > 0.1)
    drifts = (drift, vector.add(drift, vector.scale(axis, apart)))
    moment = 1e-6
    later = (
        first._replace(centre=vector.add(first.centre, vector.scale(drifts[0], moment))),
        second._replace(centre=vector.add(second.centre, vector.scale(drifts[1], moment))),
    )
    now, then = CommonBorder((first, second), drifts).gaps(point), CommonBorder(later, drifts).gaps(point)
    assert len(now) == len(then) == 5
    assert abs(then[4].distance - now[4].distance - now[4].retreat * moment) < 1e-9


def test_point_of_concentric_shells_is_on_the_border_of_the_smaller() -> None:
    large, small = Shell(ZERO, 0.1, 0.7), Shell(ZERO, 0.1, 0.5)
    assert nearest_common_point((0.0, 0.9, 0.0), large, small) == (0.0, 0.5, 0.0)
    assert nearest_common_point(ZERO, large, small) == (0.0, -0.1, 0.0)
    assert len(CommonBorder((large, small), (ZERO, ZERO)).gaps((0.0, 0.3, 0.0))) == 4
    assert max(small.excesses((0.0, 0.5, 0.0))) <= TOLERANCE


@given(points, points, st.floats(0.1, 100.0))
def test_limited_speed_needs_no_more_than_the_acceleration(
    velocity: Vector, drift: Vector, acceleration: float
) -> None:
    border = ShellBorder(Shell(ZERO, 0.1, 0.65), drift)
    relative = vector.subtract(border.limit_speed(velocity, acceleration), drift)
    assert vector.dot(relative, relative) / 0.65 <= acceleration * (1.0 + 1e-9)
    before = vector.subtract(velocity, drift)
    assert vector.length(vector.cross(relative, before)) < 1e-9
    if vector.dot(before, before) / 0.65 <= acceleration:
        assert border.limit_speed(velocity, acceleration) == velocity


def test_speed_is_limited_for_both_shells() -> None:
    border = CommonBorder((Shell(ZERO, 0.1, 0.5), Shell((0.5, 0.0, 0.0), 0.1, 0.6)), ((1.0, 0.0, 0.0), ZERO))
    assert border.limit_speed((1.0, 1.0, 0.0), 8.0) == (1.0, 1.0, 0.0)
    assert vector.length(border.limit_speed((-9.0, 5.0, 0.0), 8.0)) <= 4.8**0.5 + 1e-12
