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
    ("direction", "is_allowed"),
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
def test_allowed_and_forbidden_directions_of_the_upper_arm(direction: Vector, is_allowed: bool) -> None:
    assert (depth_in_caps(SHOULDER, vector.unit(direction, direction)) <= 0.0) == is_allowed
    x, y, z = direction
    mirrored = (-x, y, z)
    assert (depth_in_caps(make_shoulder_limit(right=True), vector.unit(mirrored, mirrored)) <= 0.0) == is_allowed


@given(directions, directions, st.floats(0.01, 2.0))
def test_min_allowed_turn_is_allowed_and_minimal(chord: Vector, other: Vector, lift: float) -> None:
    normal = vector.unit(vector.reject_from(other, chord), vector.any_perpendicular(chord))
    min_turn = min_allowed_turn(SHOULDER, chord, normal, lift)
    grid = [step * pi / 180.0 for step in range(-180, 181)]
    allowed = [t for t in grid if depth_in_caps(SHOULDER, upper_arm(chord, normal, lift, t)) <= 0.0]
    if isnan(min_turn):
        assert not allowed
        return
    assert depth_in_caps(SHOULDER, upper_arm(chord, normal, lift, min_turn)) <= 1e-9
    assert all(abs(min_turn) <= abs(t) + 1e-9 for t in allowed)


@given(directions)
def test_angle_to_allowed_is_the_distance_to_the_nearest_direction(direction: Vector) -> None:
    distance = angle_to_allowed(SHOULDER, direction)
    assert (distance == 0.0) == (depth_in_caps(SHOULDER, direction) <= 0.0)
    if distance > 0.0:
        # a slightly wider circle has an allowed direction, a slightly narrower one has none
        normal = vector.any_perpendicular(direction)
        assert not isnan(min_allowed_turn(SHOULDER, direction, normal, distance + 1e-6))
        grid = [
            upper_arm(direction, normal, max(distance - 1e-3, 0.5 * distance), step * pi / 90.0) for step in range(180)
        ]
        assert all(depth_in_caps(SHOULDER, arm_direction) > 0.0 for arm_direction in grid)


@given(directions, directions, st.floats(0.001, 0.3))
def test_step_toward_avoids_the_caps(begin: Vector, end: Vector, max_angle: float) -> None:
    if depth_in_caps(SHOULDER, begin) > 0.0 or depth_in_caps(SHOULDER, end) > 0.0:
        return
    step = step_toward(SHOULDER, begin, end, max_angle)
    assert abs(vector.length(step) - 1.0) < 1e-9
    assert depth_in_caps(SHOULDER, step) <= 1e-12
    assert vector.length(vector.subtract(step, begin)) <= 2.0 * max_angle + 1e-9


def test_axes_of_caps_are_unit_vectors() -> None:
    for axis, radius in LEFT_CAPS:
        assert abs(vector.length(axis) - 1.0) < 1e-12
        assert depth_in_caps((((axis, radius),), ()), axis) == pytest.approx(radius)
