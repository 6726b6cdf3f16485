"""Plain-float rotations equal the array rotations of `bunraku.motion.rotation`."""

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
def test_multiply_and_rotate_equal_the_array_functions(a: Quaternion, b: Quaternion, v: Vector) -> None:
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
def test_rotation_between_opposites_is_half_a_turn(a: Vector) -> None:
    opposite = vector.scale(a, -1.0)
    np.testing.assert_allclose(vector.rotate(vector.rotation_between(a, opposite), a), opposite, atol=1e-12)


@given(quaternions, quaternions, st.floats(0.0, 1.0))
def test_slerp_equals_the_array_function(a: Quaternion, b: Quaternion, t: float) -> None:
    if abs(sum(x * y for x, y in zip(a, b, strict=True))) < 1e-6:
        return  # both directions are equally short
    plain = np.array(vector.slerp(a, b, t))
    from_arrays = rotation.slerp(np.array(a), np.array(b), t)
    assert abs(abs(float(plain @ from_arrays)) - 1.0) < 1e-9


@given(units)
def test_any_perpendicular_is_perpendicular_and_unit(a: Vector) -> None:
    perpendicular = vector.any_perpendicular(a)
    assert abs(vector.dot(perpendicular, a)) < 1e-12
    assert abs(vector.length(perpendicular) - 1.0) < 1e-12


@given(quaternions, st.floats(0.0, 1.0))
def test_scaled_rotations_compose_to_the_rotation(q: Quaternion, share: float) -> None:
    composed = vector.multiply(vector.scale_rotation(q, 1.0 - share), vector.scale_rotation(q, share))
    np.testing.assert_allclose(composed, q, atol=1e-9)
    assert vector.scale_rotation(q, 0.0) == pytest.approx(vector.IDENTITY)
