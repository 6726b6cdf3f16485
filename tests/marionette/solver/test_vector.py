"""The plain-float rotations say what the rotations over arrays say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Quaternion, Vector
from bunraku.motion import rotation

parts = st.floats(-2.0, 2.0)
vectors = st.tuples(parts, parts, parts)
quaternions = st.tuples(parts, parts, parts, parts).filter(lambda q: sum(x * x for x in q) > 1e-3).map(vector.normalise)
units = vectors.filter(lambda v: vector.length(v) > 1e-2).map(lambda v: vector.unit(v, (0.0, 0.0, 1.0)))


@given(quaternions, quaternions, vectors)
def test_multiply_and_rotate_agree_with_the_arrays(a: Quaternion, b: Quaternion, v: Vector) -> None:
    np.testing.assert_allclose(vector.multiply(a, b), rotation.multiply(np.array(a), np.array(b)), atol=1e-14)
    np.testing.assert_allclose(vector.rotate(a, v), rotation.rotate(np.array(a), np.array(v)), atol=1e-13)


@given(quaternions)
def test_columns_give_the_rotation_back(q: Quaternion) -> None:
    x, y, z = (vector.rotate(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
    again = vector.from_columns(x, y, z)
    for axis in (x, y, z):
        np.testing.assert_allclose(vector.rotate(again, axis), vector.rotate(q, axis), atol=1e-12)


@given(units, units)
def test_between_brings_one_to_the_other(a: Vector, b: Vector) -> None:
    np.testing.assert_allclose(vector.rotate(vector.rotation_between(a, b), a), b, atol=1e-6)


@given(units)
def test_between_opposites_is_half_a_turn(a: Vector) -> None:
    opposite = vector.scale(a, -1.0)
    np.testing.assert_allclose(vector.rotate(vector.rotation_between(a, opposite), a), opposite, atol=1e-12)


@given(quaternions, quaternions, st.floats(0.0, 1.0))
def test_slerp_agrees_with_the_arrays(a: Quaternion, b: Quaternion, t: float) -> None:
    if abs(sum(x * y for x, y in zip(a, b, strict=True))) < 1e-6:
        return  # both ways are as short
    here = np.array(vector.slerp(a, b, t))
    there = rotation.slerp(np.array(a), np.array(b), t)
    assert abs(abs(float(here @ there)) - 1.0) < 1e-9


@given(units)
def test_across_is_square_and_unit(a: Vector) -> None:
    square = vector.any_perpendicular(a)
    assert abs(vector.dot(square, a)) < 1e-12
    assert abs(vector.length(square) - 1.0) < 1e-12


@given(quaternions, st.floats(0.0, 1.0))
def test_a_part_of_a_turn_goes_its_own_way_round(q: Quaternion, share: float) -> None:
    rest = vector.multiply(vector.scale_rotation(q, 1.0 - share), vector.scale_rotation(q, share))
    np.testing.assert_allclose(rest, q, atol=1e-9)
    assert vector.scale_rotation(q, 0.0) == pytest.approx(vector.IDENTITY)
