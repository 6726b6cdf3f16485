from __future__ import annotations

from math import cos, isnan, pi, radians, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.solver import vector
from bunraku.marionette.solver.shoulder import (
    LEFT_CAPS,
    angle_to_allowed,
    depth_in_caps,
    make_shoulder_limit,
    min_allowed_turn,
    step_toward,
)
from bunraku.marionette.solver.vector import Vector

SHOULDER = make_shoulder_limit(right=False)
parts = st.floats(-1.0, 1.0)
directions = st.tuples(parts, parts, parts).filter(lambda v: vector.length(v) > 0.1).map(lambda v: vector.unit(v, v))


def upper_arm(chord: Vector, normal: Vector, lift: float, angle: float) -> Vector:
    turned = vector.rotate(vector.from_axis_angle(chord, angle), normal)
    return vector.add(vector.scale(chord, cos(lift)), vector.scale(vector.cross(chord, turned), sin(lift)))


@pytest.mark.parametrize(
    ("direction", "goes"),
    [
        ((0.0, -1.0, 0.0), True),  # hanging
        ((0.0, 1.0, 0.0), True),  # overhead
        ((1.0, 0.0, 0.0), True),  # out to the side
        ((0.0, 0.0, 1.0), True),  # straight ahead
        ((0.0, -cos(radians(55)), -sin(radians(55))), True),  # 55 degrees back
        ((cos(radians(45)), 0.0, -sin(radians(45))), True),  # the side, 45 degrees back
        ((-cos(radians(45)), 0.0, sin(radians(45))), True),  # across the chest
        ((0.0, 0.0, -1.0), False),  # straight back
        ((0.0, 0.7, -0.7), False),  # up and back
        ((-1.0, 0.0, 0.0), False),  # through the chest
        ((-0.8, 0.0, -0.6), False),  # across the back
    ],
)
def test_an_arm_goes_where_arms_go(direction: Vector, goes: bool) -> None:
    assert (depth_in_caps(SHOULDER, vector.unit(direction, direction)) <= 0.0) == goes
    x, y, z = direction
    mirrored = (-x, y, z)
    assert (depth_in_caps(make_shoulder_limit(right=True), vector.unit(mirrored, mirrored)) <= 0.0) == goes


@given(directions, directions, st.floats(0.01, 2.0))
def test_the_least_turn_is_allowed_and_none_less_is(chord: Vector, other: Vector, lift: float) -> None:
    normal = vector.unit(vector.reject_from(other, chord), vector.any_perpendicular(chord))
    least = min_allowed_turn(SHOULDER, chord, normal, lift)
    grid = [step * pi / 180.0 for step in range(-180, 181)]
    allowed = [t for t in grid if depth_in_caps(SHOULDER, upper_arm(chord, normal, lift, t)) <= 0.0]
    if isnan(least):
        assert not allowed
        return
    assert depth_in_caps(SHOULDER, upper_arm(chord, normal, lift, least)) <= 1e-9
    assert all(abs(least) <= abs(t) + 1e-9 for t in allowed)


@given(directions)
def test_the_nearest_direction_is_that_far_away(direction: Vector) -> None:
    far = angle_to_allowed(SHOULDER, direction)
    assert (far == 0.0) == (depth_in_caps(SHOULDER, direction) <= 0.0)
    if far > 0.0:
        # a circle a little wider has a place where an arm goes, one a little narrower has none
        normal = vector.any_perpendicular(direction)
        assert not isnan(min_allowed_turn(SHOULDER, direction, normal, far + 1e-6))
        grid = [upper_arm(direction, normal, max(far - 1e-3, 0.5 * far), step * pi / 90.0) for step in range(180)]
        assert all(depth_in_caps(SHOULDER, place) > 0.0 for place in grid)


@given(directions, directions, st.floats(0.001, 0.3))
def test_the_way_to_another_direction_goes_round_the_caps(begin: Vector, end: Vector, most: float) -> None:
    if depth_in_caps(SHOULDER, begin) > 0.0 or depth_in_caps(SHOULDER, end) > 0.0:
        return
    step = step_toward(SHOULDER, begin, end, most)
    assert abs(vector.length(step) - 1.0) < 1e-9
    assert depth_in_caps(SHOULDER, step) <= 1e-12
    assert vector.length(vector.subtract(step, begin)) <= 2.0 * most + 1e-9


def test_caps_are_of_unit_axes() -> None:
    for axis, radius in LEFT_CAPS:
        assert abs(vector.length(axis) - 1.0) < 1e-12
        assert depth_in_caps((((axis, radius),), ()), axis) == pytest.approx(radius)
