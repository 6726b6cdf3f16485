from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette.bodies import BODIES, Body
from bunraku.marionette.paper import (
    DISTANCE_NODES,
    ELEVATION_NODES,
    PAPER_BYTES,
    PaperTable,
    build_paper_table,
    joint_positions,
    paper_angles,
    tip_error,
)
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

TABLES = {body.name: build_paper_table(body.proportions) for body in BODIES}
each_body = pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)


def potential(body: Body, angles: Array) -> Array:
    """The paper's E as it stands in 4.2, without g."""
    (l0, l1, l2), (m0, m1, m2) = body.proportions.lengths, body.proportions.masses
    t0, t1, t2 = np.sin(angles)
    wrist = l0 * t0 + l1 * t1
    energy: Array = (m0 * l0 * t0 + m1 * (l0 * t0 + wrist) + m2 * (wrist + l2 * t2 + wrist)) / 2.0
    return energy


@each_body
def test_the_tip_is_as_near_as_the_paper_says_and_nearer(body: Body) -> None:
    random = np.random.default_rng(4)
    for r in (np.sqrt(random.uniform(0.0, 1.0, 50_000)), random.uniform(0.0, 1.0, 50_000)):
        error = tip_error(body.proportions, TABLES[body.name], r, random.uniform(-np.pi / 2.0, np.pi / 2.0, 50_000))
        # the paper: 0.1 % of the arm on average, 5 % at most
        assert error.mean() <= 0.0004
        assert error.max() <= 0.003


@each_body
def test_nodes_reach_their_targets_in_the_pose_of_least_potential(body: Body) -> None:
    table: PaperTable = TABLES[body.name]
    assert table.shape == (3, DISTANCE_NODES, ELEVATION_NODES)
    assert table.nbytes == PAPER_BYTES == 23_028
    random = np.random.default_rng(5)
    for _ in range(60):
        i, j = int(random.integers(1, DISTANCE_NODES - 1)), int(random.integers(1, ELEVATION_NODES - 1))
        target = i / (DISTANCE_NODES - 1) * np.exp(1j * np.pi * (j / (ELEVATION_NODES - 1) - 0.5))
        angles = table[:, i, j].astype(np.float64)[:, None]
        assert abs(joint_positions(body.proportions, angles)[2, 0] - target) < 2e-7
        # any other pose of the three links: the upper arm anywhere, the rest closed on the target by hand
        upper, fore, hand = body.proportions.lengths
        t0 = np.linspace(-np.pi, np.pi, 7201)
        line = target - upper * np.exp(1j * t0)
        cosine = (np.abs(line) ** 2 + fore**2 - hand**2) / (2.0 * fore * np.abs(line))
        t0, line, cosine = (values[np.abs(cosine) <= 1.0] for values in (t0, line, cosine))
        t1 = np.angle(line) - np.arccos(cosine)
        t2 = np.angle(line - fore * np.exp(1j * t1))
        # the elbow bends one way, as the wrist does here
        bent = np.mod(t1 - t0, 2.0 * np.pi) <= np.pi
        lowest = potential(body, np.array([t0, t1, t2])[:, bent]).min()
        assert float(potential(body, angles)[0]) <= lowest + 1e-7


@each_body
def test_neighbouring_nodes_are_near_so_that_no_angle_jumps(body: Body) -> None:
    table = TABLES[body.name].astype(np.float64)
    for axis in (1, 2):
        assert np.abs(np.diff(table, axis=axis)).max() < 0.5
    bends = np.diff(table, axis=0)
    assert bends.min() >= -1e-6
    assert bends.max() <= np.pi + 1e-6


@pytest.mark.parametrize(
    "identity", ["600-200-200-900-50-50", "200-600-200-100-100-800", "150-150-700-333-333-334", "780-200-20-998-1-1"]
)
def test_an_arm_that_cannot_fold_to_the_shoulder_has_angles_there_too(identity: str) -> None:
    proportions = Proportions.parse(identity)
    table = build_paper_table(proportions)
    assert np.isfinite(table).all()
    # such arms may have two valleys, and the mix of one pose from each is neither
    random = np.random.default_rng(6)
    r, beta = random.uniform(2.0 * max(proportions.lengths) - 1.0, 1.0, 5000), random.uniform(-1.5, 1.5, 5000)
    assert tip_error(proportions, table, r, beta).mean() < 0.005


def test_a_lookup_at_a_node_is_the_node() -> None:
    table = TABLES["Winter"]
    got = paper_angles(table, np.array([0.0, 0.37, 1.0]), np.array([-0.5, 0.0, 0.5]) * np.pi)
    np.testing.assert_allclose(got, table[:, [0, 37, 100], [0, 9, 18]], atol=1e-6)
