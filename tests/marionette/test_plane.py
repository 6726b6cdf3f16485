from __future__ import annotations

from math import cos, pi, radians, sin

from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import vector
from bunraku.marionette.plane import FASTEST, Plane, vertical_normal
from bunraku.marionette.vector import Vector

UP = (0.0, 1.0, 0.0)
DOWN = (0.0, -1.0, 0.0)
parts = st.floats(-1.0, 1.0)
units = st.tuples(parts, parts, parts).filter(lambda v: vector.length(v) > 0.05).map(lambda v: vector.unit(v, UP))
FRAME = 1.0 / 60.0


@given(units, st.lists(st.tuples(units, st.floats(0.1, 1.0)), min_size=1, max_size=20))
def test_the_tip_stays_in_the_plane(start: Vector, way: list[tuple[Vector, float]]) -> None:
    plane = Plane((1.0, 0.0, 0.0), start)
    for direction, reach in way:
        normal = plane.follow(direction, reach, UP, FRAME)
        assert abs(vector.length(normal) - 1.0) < 1e-9
        assert abs(vector.dot(normal, direction)) < 1e-9


@given(units, units)
def test_a_still_hand_off_the_axis_comes_to_hang_vertically(direction: Vector, normal: Vector) -> None:
    if abs(direction[1]) > 0.95:
        return
    plane = Plane(normal, direction)
    for _ in range(240):
        plane.follow(direction, 0.7, UP, FRAME)
    wanted = vertical_normal(direction, UP)
    assert wanted is not None
    assert vector.dot(plane.normal, wanted) > 1.0 - 1e-6


def test_on_the_axis_the_plane_stays_as_it_was() -> None:
    normal = (-cos(1.0), 0.0, sin(1.0))
    plane = Plane(normal, DOWN)
    for _ in range(60):
        plane.follow(DOWN, 0.7, UP, FRAME)
    assert vector.length(vector.subtract(plane.normal, normal)) < 1e-9


@given(st.floats(-0.02, 0.02), st.floats(0.5, 4.0))
def test_a_hand_that_passes_under_the_shoulder_does_not_throw_the_elbow(aside: float, speed: float) -> None:
    """The vertical plane would turn half round in one frame; the carried one turns at most as it may swing, and as the
    hand itself turns."""
    start = (aside, -0.6, -0.5)
    plane = Plane(vertical_normal(vector.unit(start, DOWN), UP) or (1.0, 0.0, 0.0), vector.unit(start, DOWN))
    before, last = plane.normal, vector.unit(start, DOWN)
    for i in range(round(1.0 / speed / FRAME)):
        hand = (aside, -0.6, -0.5 + speed * FRAME * i)
        direction = vector.unit(hand, DOWN)
        normal = plane.follow(direction, vector.length(hand), UP, FRAME)
        turned = vector.length(vector.subtract(normal, before))
        moved = vector.length(vector.subtract(direction, last))
        assert turned <= FASTEST * FRAME + 1.1 * moved + 1e-9
        before, last = normal, direction


def test_the_bend_lifts_the_outer_end() -> None:
    ahead = (0.0, -sin(radians(40.0)), cos(radians(40.0)))
    normal = vertical_normal(ahead, UP)
    assert normal is not None
    assert vector.rotate(vector.about(normal, 0.1), ahead)[1] > ahead[1]
    assert vertical_normal(UP, UP) is None
    assert abs(vector.dot(normal, ahead)) < 1e-12
    assert abs(2.0 * pi - FASTEST) < 1e-12
