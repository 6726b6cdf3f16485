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
for_each_body = pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)


def potential(body: Body, angles: Array) -> Array:
    """Return the potential energy E of the paper (4.2), without g."""
    (l0, l1, l2), (m0, m1, m2) = body.proportions.lengths, body.proportions.masses
    t0, t1, t2 = np.sin(angles)
    wrist = l0 * t0 + l1 * t1
    energy: Array = (m0 * l0 * t0 + m1 * (l0 * t0 + wrist) + m2 * (wrist + l2 * t2 + wrist)) / 2.0
    return energy


@for_each_body
def test_tip_error_is_within_the_bounds_of_the_paper(body: Body) -> None:
    random = np.random.default_rng(4)
    for r in (np.sqrt(random.uniform(0.0, 1.0, 50_000)), random.uniform(0.0, 1.0, 50_000)):
        error = tip_error(body.proportions, TABLES[body.name], r, random.uniform(-np.pi / 2.0, np.pi / 2.0, 50_000))
        # bounds of the paper: mean 0.1 % of the arm length, maximum 5 %
        assert error.mean() <= 0.0004
        assert error.max() <= 0.003


@for_each_body
def test_nodes_reach_their_targets_with_the_least_potential(body: Body) -> None:
    table: PaperTable = TABLES[body.name]
    assert table.shape == (3, DISTANCE_NODES, ELEVATION_NODES)
    assert table.nbytes == PAPER_BYTES == 23_028
    random = np.random.default_rng(5)
    for _ in range(60):
        i, j = int(random.integers(1, DISTANCE_NODES - 1)), int(random.integers(1, ELEVATION_NODES - 1))
        target = i / (DISTANCE_NODES - 1) * np.exp(1j * np.pi * (j / (ELEVATION_NODES - 1) - 0.5))
        angles = table[:, i, j].astype(np.float64)[:, None]
        assert abs(joint_positions(body.proportions, angles)[2, 0] - target) < 2e-7
        # all other poses: any direction of the upper arm, the other two links closed on the target
        upper, forearm, hand = body.proportions.lengths
        t0 = np.linspace(-np.pi, np.pi, 7201)
        rest_of_chain = target - upper * np.exp(1j * t0)
        cosine = (np.abs(rest_of_chain) ** 2 + forearm**2 - hand**2) / (2.0 * forearm * np.abs(rest_of_chain))
        t0, rest_of_chain, cosine = (values[np.abs(cosine) <= 1.0] for values in (t0, rest_of_chain, cosine))
        t1 = np.angle(rest_of_chain) - np.arccos(cosine)
        t2 = np.angle(rest_of_chain - forearm * np.exp(1j * t1))
        # the elbow bends one way only, and so does the wrist here
        is_allowed = np.mod(t1 - t0, 2.0 * np.pi) <= np.pi
        lowest = potential(body, np.array([t0, t1, t2])[:, is_allowed]).min()
        assert float(potential(body, angles)[0]) <= lowest + 1e-7


@for_each_body
def test_neighbouring_nodes_differ_little(body: Body) -> None:
    table = TABLES[body.name].astype(np.float64)
    for axis in (1, 2):
        assert np.abs(np.diff(table, axis=axis)).max() < 0.5
    bends = np.diff(table, axis=0)
    assert bends.min() >= -1e-6
    assert bends.max() <= np.pi + 1e-6


@pytest.mark.parametrize(
    "identity", ["600-200-200-900-50-50", "200-600-200-100-100-800", "150-150-700-333-333-334", "780-200-20-998-1-1"]
)
def test_table_of_an_arm_that_cannot_reach_its_shoulder_is_finite(identity: str) -> None:
    proportions = Proportions.parse(identity)
    table = build_paper_table(proportions)
    assert np.isfinite(table).all()
    # such arms may have two minima; interpolation between them is inaccurate
    random = np.random.default_rng(6)
    r, beta = random.uniform(2.0 * max(proportions.lengths) - 1.0, 1.0, 5000), random.uniform(-1.5, 1.5, 5000)
    assert tip_error(proportions, table, r, beta).mean() < 0.005


def test_lookup_at_a_node_returns_the_node() -> None:
    table = TABLES["Winter"]
    angles = paper_angles(table, np.array([0.0, 0.37, 1.0]), np.array([-0.5, 0.0, 0.5]) * np.pi)
    np.testing.assert_allclose(angles, table[:, [0, 37, 100], [0, 9, 18]], atol=1e-6)
