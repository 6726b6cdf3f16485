from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.bond.carrier import Carrier, Shoulder
from bunraku.marionette.bond.common_reach import Shell
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import IDENTITY, Vector

parts = st.floats(-1.0, 1.0)
points = st.tuples(parts, parts, parts)
shares = st.floats(0.0, 1.0)
FRAME_S = 1.0 / 60.0


def shoulder(position: Vector, turn: float = 0.0) -> Shoulder:
    return Shoulder(position, vector.from_axis_angle((0.0, 1.0, 0.0), turn), 0.65, 0.12)


def assert_near(found: Vector, expected: Vector) -> None:
    assert vector.length(vector.subtract(found, expected)) < 1e-9


@given(points, points, st.floats(-3.0, 3.0))
def test_place_and_position_are_inverse(position: Vector, place: Vector, turn: float) -> None:
    one = shoulder(position, turn)
    assert_near(one.to_place(one.to_world(place)), place)


@given(points, points, points, shares, st.floats(-0.5, 0.5))
def test_rigid_body_carries_its_points(point: Vector, place: Vector, moved: Vector, share: float, turn: float) -> None:
    before = (shoulder((0.0, 0.0, 0.0)), shoulder(place))
    swing = vector.from_axis_angle((0.0, 1.0, 0.0), turn)
    now = (shoulder(moved, turn), shoulder(vector.add(moved, vector.rotate(swing, place)), turn))
    carrier = Carrier(before, now, share)
    assert_near(carrier.move(point), vector.add(moved, vector.rotate(swing, point)))
    assert_near(vector.rotate(carrier.rotation, point), vector.rotate(swing, point))
    for side in (0, 1):
        assert_near(carrier.slip(side, point, FRAME_S), (0.0, 0.0, 0.0))
        assert vector.length(carrier.drift(side, FRAME_S)) < 1e-6


@given(points, points)
def test_whole_share_follows_one_shoulder(point: Vector, moved: Vector) -> None:
    before = (shoulder((0.0, 0.0, 0.0)), shoulder((0.7, 0.0, 0.0), 3.0))
    now = (before[0], shoulder(vector.add((0.7, 0.0, 0.0), vector.scale(moved, 0.1)), 3.1))
    carrier = Carrier(before, now, 1.0)
    assert_near(carrier.move(point), point)
    assert_near(carrier.drift(1, FRAME_S), vector.scale(moved, 0.1 / FRAME_S))
    shells = (Shell((0.0, 0.0, 0.0), 0.1, 0.6), Shell(now[1].position, 0.1, 0.6))
    assert carrier.border(shells, FRAME_S).drifts == (carrier.drift(0, FRAME_S), carrier.drift(1, FRAME_S))


def test_opposite_turns_cancel() -> None:
    before = (shoulder((0.0, 0.0, 0.0)), shoulder((0.7, 0.0, 0.0)))
    now = (shoulder((0.0, 0.0, 0.0), 0.2), shoulder((0.7, 0.0, 0.0), -0.2))
    w, x, y, z = Carrier(before, now, 0.5).rotation
    assert_near((x, y, z), (0.0, 0.0, 0.0))
    assert abs(w - IDENTITY[0]) < 1e-12


@given(points, points, points, shares)
def test_spread_is_the_difference_of_both_slips(point: Vector, moved: Vector, other: Vector, share: float) -> None:
    before = (shoulder((0.0, 0.0, 0.0)), shoulder((0.7, 0.0, 0.0), 3.0))
    carrier = Carrier(before, (shoulder(moved, 0.2), shoulder(other, 2.9)), share)
    slips = [vector.rotate(carrier.rotation, carrier.slip(side, point, FRAME_S)) for side in (0, 1)]
    assert_near(carrier.spread(point, FRAME_S), vector.subtract(slips[0], slips[1]))
