from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bunraku.motion import rotation

COMPONENT = st.floats(-1, 1, allow_nan=False, width=32)
VECTORS = arrays(np.float64, 3, elements=COMPONENT)
ROTATIONS = VECTORS.map(lambda v: rotation.from_rotation_vector(v * 3))


@given(ROTATIONS, ROTATIONS, VECTORS)
def test_multiply_composes_rotations(a: rotation.Array, b: rotation.Array, v: rotation.Array) -> None:
    np.testing.assert_allclose(
        rotation.rotate(rotation.multiply(a, b), v), rotation.rotate(a, rotation.rotate(b, v)), atol=1e-12
    )


@given(ROTATIONS, VECTORS)
def test_rotate_keeps_lengths_and_conjugate_inverts_it(q: rotation.Array, v: rotation.Array) -> None:
    turned = rotation.rotate(q, v)
    assert np.isclose(np.linalg.norm(turned), np.linalg.norm(v), atol=1e-12)
    np.testing.assert_allclose(rotation.rotate(rotation.conjugate(q), turned), v, atol=1e-12)


@given(ROTATIONS)
def test_every_representation_round_trips(q: rotation.Array) -> None:
    for again in (
        rotation.from_rotation_vector(rotation.to_rotation_vector(q)),
        rotation.from_axis_angle(rotation.to_axis_angle(q)),
        rotation.from_matrix(rotation.to_matrix(q)),
    ):
        assert abs(abs(np.dot(again, q)) - 1) < 1e-12


def test_half_turns_keep_their_axis_through_a_matrix() -> None:
    for axis in range(3):
        q = rotation.from_coordinate_axis(axis, np.array(np.pi))
        assert abs(abs(np.dot(rotation.from_matrix(rotation.to_matrix(q)), q)) - 1) < 1e-12


@given(VECTORS, VECTORS)
def test_rotation_between_aligns_directions(a: rotation.Array, b: rotation.Array) -> None:
    a, b = rotation.normalise(a), rotation.normalise(b)
    if np.linalg.norm(a) > 0 and np.linalg.norm(b) > 0:
        np.testing.assert_allclose(rotation.rotate(rotation.rotation_between(a, b), a), b, atol=1e-5)


def test_opposite_directions_give_a_half_turn() -> None:
    a = np.array([[1.0, 0, 0], [0, 0, -1.0]])
    np.testing.assert_allclose(rotation.rotate(rotation.rotation_between(a, -a), a), -a, atol=1e-12)


@given(ROTATIONS, ROTATIONS, st.floats(0, 1))
def test_slerp_has_constant_speed(a: rotation.Array, b: rotation.Array, t: float) -> None:
    def angle(x: rotation.Array, y: rotation.Array) -> float:
        return float(np.linalg.norm(rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(x), y))))

    middle = rotation.slerp(a, b, t)
    assert np.isclose(angle(a, middle), t * angle(a, b), atol=1e-6)
    assert np.isclose(angle(middle, b), (1 - t) * angle(a, b), atol=1e-6)


def test_unwrapped_vectors_follow_three_turns() -> None:
    angle = np.linspace(0, 6 * np.pi, 200)
    wrapped = rotation.to_rotation_vector(rotation.from_coordinate_axis(1, angle))
    followed = rotation.unwrap_rotation_vectors(wrapped)
    np.testing.assert_allclose(followed[:, 1], angle, atol=1e-9)
