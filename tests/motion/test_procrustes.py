from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import procrustes, rotation
from bunraku.motion.rotation import Array

ONES = np.ones(3)


def random_rotations(random: np.random.Generator, n: int, max_angle: float = 2.0) -> Array:
    return rotation.from_rotation_vector(random.uniform(-max_angle, max_angle, (n, 3)))


def random_points(random: np.random.Generator) -> Array:
    """Three points (3, 3) that span a plane well."""
    return np.array([[0.0, 0.5, 0.0], [0.2, 0.4, 0.0], [-0.2, 0.4, 0.1]]) + random.uniform(-0.05, 0.05, (3, 3))


@given(seed=st.integers(0, 10_000))
def test_kabsch_recovers_the_rotation(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, turn = random_points(random), random_rotations(random, 20)
    found = procrustes.solve_kabsch(points, rotation.rotate(turn[:, None], points), np.array([1.0, 2.0, 2.0]))
    np.testing.assert_allclose(np.abs(np.sum(found * turn, axis=-1)), 1.0, atol=1e-9)


@given(seed=st.integers(0, 10_000))
def test_kabsch_is_a_local_optimum(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, weights = random_points(random), random.uniform(0.5, 2.0, 3)
    targets = rotation.rotate(random_rotations(random, 5)[:, None], points) + random.normal(0.0, 0.05, (5, 3, 3))
    found = procrustes.solve_kabsch(points, targets, weights)
    least = procrustes.rms_error(found, points, targets, weights)
    beside = rotation.multiply(random_rotations(random, 5, 0.1), found)
    assert procrustes.rms_error(beside, points, targets, weights) >= least - 1e-12


@given(seed=st.integers(0, 10_000))
def test_kabsch_never_mirrors(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(0.0, 1.0, (4, 3))
    found = procrustes.solve_kabsch(points, points * [-1.0, 1.0, 1.0], np.ones(4))
    np.testing.assert_allclose(np.linalg.det(rotation.to_matrix(found)), 1.0, atol=1e-9)


@given(seed=st.integers(0, 10_000))
def test_two_points_are_aligned(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = np.array([[0.2, 0.4, 0.0], [-0.2, 0.4, 0.0]])
    targets = rotation.rotate(random_rotations(random, 6)[:, None], points)
    found = procrustes.solve_kabsch(points, targets, np.ones(2))
    np.testing.assert_allclose(rotation.rotate(found[:, None], points), targets, atol=1e-9)


@given(seed=st.integers(0, 10_000))
def test_mean_local_positions_of_rigid_points_are_exact(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, turn = random_points(random), random_rotations(random, 20)
    targets = rotation.rotate(turn[:, None], points)
    np.testing.assert_allclose(procrustes.mean_local_positions(turn, targets), points, atol=1e-12)


def test_rms_error_is_weighted() -> None:
    still = np.tile(rotation.IDENTITY, (2, 1))
    targets = np.zeros((2, 2, 3))
    targets[0, 0, 0], targets[1, 1, 1] = 3.0, 4.0
    # the squares 9 (weight 1) and 16 (weight 3) over 2 frames and a weight of 4
    expected = np.sqrt((9.0 + 48.0) / 2.0 / 4.0)
    assert procrustes.rms_error(still, np.zeros((2, 3)), targets, np.array([1.0, 3.0])) == pytest.approx(expected)


@given(seed=st.integers(0, 10_000))
def test_fitted_positions_of_rigid_points_equal_their_rest(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, turn = random_points(random), random_rotations(random, 30, 0.6)
    targets = rotation.rotate(turn[:, None], points)
    wrong = rotation.multiply(turn, random_rotations(random, 30, 0.2))
    np.testing.assert_allclose(procrustes.fit_local_positions(wrong, targets, ONES, points), points, atol=1e-6)


@given(seed=st.integers(0, 10_000))
def test_fitted_positions_are_no_worse_than_the_initial_means(seed: int) -> None:
    random = np.random.default_rng(seed)
    points, turn = random_points(random), random_rotations(random, 30, 0.6)
    targets = rotation.rotate(turn[:, None], points) + random.normal(0.0, 0.03, (30, 3, 3))
    start = procrustes.mean_local_positions(turn, targets)
    fitted = procrustes.fit_local_positions(turn, targets, ONES, points)
    before = procrustes.rms_error(turn, start, targets, ONES)
    after = procrustes.rms_error(procrustes.solve_kabsch(fitted, targets, ONES), fitted, targets, ONES)
    assert after <= before + 1e-12
