from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from examples.robot.strings import LENGTH_M, MAX_TENSION_SHARE, WEIGHT_SHARE, string_forces

MASS = 70.0
POINTS = np.array([[0.1, 0.9, 0.0], [-0.1, 0.9, 0.0], [0.0, 1.7, 0.0]])
UP = np.array([0.0, 1.0, 0.0])
STILL = np.zeros_like(POINTS)


def test_strings_carry_their_share_of_the_weight_in_the_performers_pose() -> None:
    forces = string_forces(POINTS, STILL, POINTS, MASS)
    assert forces.sum(axis=0) == pytest.approx([0, WEIGHT_SHARE * MASS * 9.81, 0])


def test_slack_string_does_not_push() -> None:
    assert not string_forces(POINTS + 0.1 * UP, STILL - 1.0, POINTS, MASS).any()


@given(st.integers(0, 2**32 - 1))
def test_strings_pull_towards_the_bar_with_a_limited_tension(seed: int) -> None:
    generator = np.random.default_rng(seed)
    points, speeds = POINTS + generator.normal(size=POINTS.shape), generator.normal(size=POINTS.shape) * 5
    forces = string_forces(points, speeds, POINTS, MASS)
    assert ((forces * (POINTS + LENGTH_M * UP - points)).sum(axis=1) >= 0).all()
    assert np.linalg.norm(forces, axis=1).max() <= MAX_TENSION_SHARE * MASS * 9.81 + 1e-9
