from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette import arm_batch, bend_table
from bunraku.marionette.arm import Arm, BendTable, wrist_bend_limits
from bunraku.marionette.constants import MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD
from bunraku.marionette.proportions import Proportions
from tests.marionette.fixtures import ARM_PROPORTIONS, random_tips

positions = st.tuples(*[st.floats(-1.5, 1.5)] * 3)


@pytest.mark.parametrize("proportions", ARM_PROPORTIONS, ids=lambda p: p.identity)
def test_tip_is_exact_and_joints_are_within_their_limits(proportions: Proportions) -> None:
    targets = random_tips(proportions, 20_000, seed=1)
    solved = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), targets)
    assert float(np.abs(solved.tip - targets).max()) < 1e-14
    t0, t1, t2 = solved.angles()
    elbow, wrist = t1 - t0, t2 - t1
    assert elbow.min() >= -1e-9
    assert elbow.max() <= MAX_ELBOW_BEND_RAD + 1e-9
    assert wrist.min() >= -1e-12
    assert wrist.max() <= MAX_WRIST_BEND_RAD + 1e-12
    links = np.diff(np.stack([np.zeros_like(solved.elbow), solved.elbow, solved.wrist, solved.tip]), axis=0)
    lengths = np.linalg.norm(links, axis=2)
    np.testing.assert_allclose(lengths, np.array(proportions.lengths)[:, None] * np.ones(len(targets)), atol=1e-12)


@pytest.mark.parametrize("proportions", ARM_PROPORTIONS, ids=lambda p: p.identity)
def test_bend_has_the_least_potential_energy(proportions: Proportions) -> None:
    targets = random_tips(proportions, 500, seed=2)
    solved = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), targets)
    r = np.linalg.norm(targets, axis=1)
    beta = np.arcsin(targets[:, 1] / r)
    low, high = wrist_bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, 400)[:, None]
    potentials = bend_table.potential(proportions, r, beta, low + shares * (high - low))
    _, t1, t2 = solved.angles()
    excess = bend_table.potential(proportions, r, beta, t2 - t1) - potentials.min(axis=0)
    # the potential is flat around its minimum; interpolation is coarser in the corners near the shoulder
    assert float(np.percentile(excess, 98)) < 1e-4
    assert float(excess.max()) < 1e-3


@given(st.sampled_from(ARM_PROPORTIONS), positions)
def test_single_arm_equals_the_batch(proportions: Proportions, position: tuple[float, float, float]) -> None:
    stored = bend_table.load_bend_table(proportions.identity)
    target = np.array([position])
    solved = arm_batch.solve_arms(proportions, stored, target)
    one = Arm(proportions, stored)
    rho, y = float(np.hypot(target[0, 0], target[0, 2])), float(target[0, 1])
    beta = float(np.arctan2(y, rho)) if np.hypot(rho, y) >= 1e-12 else -np.pi / 2.0
    angles = one.solve_angles(one.clamp_distance(float(np.hypot(rho, y))), beta)
    np.testing.assert_allclose(angles, np.array(solved.angles())[:, 0], atol=1e-11)


@given(st.sampled_from(ARM_PROPORTIONS), positions)
def test_unreachable_target_is_clamped_along_its_direction(
    proportions: Proportions, position: tuple[float, float, float]
) -> None:
    target = np.array([position])
    distance = float(np.linalg.norm(target))
    tip = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), target).tip[0]
    reach = min(max(distance, proportions.min_tip_distance), MAX_TIP_DISTANCE)
    expected = target[0] / distance * reach if distance >= 1e-12 else np.array([0.0, -reach, 0.0])
    np.testing.assert_allclose(tip, expected, atol=1e-9)


@given(st.sampled_from(ARM_PROPORTIONS), positions, st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_small_step_of_the_hand_causes_a_small_step_of_the_arm(
    proportions: Proportions, position: tuple[float, float, float], step: tuple[float, float, float]
) -> None:
    """The bend changes by at most 12 radians per arm length, except near the axis and the straight arm."""
    here = np.array([position])
    there = here + 1e-4 * np.array([step])
    rho = np.hypot(here[:, 0], here[:, 2])
    distance = float(np.linalg.norm(here))
    if rho < 0.02 or distance > 0.97:
        return
    stored = bend_table.load_bend_table(proportions.identity)
    a, b = arm_batch.solve_arms(proportions, stored, here), arm_batch.solve_arms(proportions, stored, there)
    bends = [np.diff(np.array(solved.angles()), axis=0) for solved in (a, b)]
    moved = float(np.abs(bends[0] - bends[1]).max())
    assert moved <= 12.0 * 1e-4 * np.sqrt(3.0) / max(min(distance, 1.0), 0.1)


def test_target_straight_below_bends_the_arm_forwards() -> None:
    proportions = ARM_PROPORTIONS[0]
    solved = arm_batch.solve_arms(
        proportions, bend_table.load_bend_table(proportions.identity), np.array([[0.0, -0.7, 0.0], [0.0, 0.0, 0.0]])
    )
    assert solved.azimuth.tolist() == [0.0, 0.0]
    assert solved.elbow[0, 2] < 0.0  # the elbow points backwards
    np.testing.assert_allclose(solved.tip[1], [0.0, -proportions.min_tip_distance, 0.0], atol=1e-12)


def solve_by_specification(proportions: Proportions, stored: BendTable, x: float, y: float) -> list[complex]:
    """Return elbow, wrist and tip by the formulas of `proto/SPEC.md` ("Arm table")."""
    a, b, c = proportions.lengths
    inner = min(
        abs(a + rest * np.exp(1j * min(np.radians(150.0), np.pi - np.angle(rest))))
        for rest in (b + c * np.exp(1j * np.radians(degrees)) for degrees in range(81))
    )
    inner = max(0.1, 1.25 * inner)
    distance = np.hypot(x, y)
    r = min(max(distance, inner), 1.0 - 1e-6)
    p = (x + 1j * y) * r / distance
    q = np.sqrt((1.0 - r) / (1.0 - inner))
    row, column = 63.0 * (1.0 - q) * (1.0 + 3.0 * q / 4.0), 63.0 * (1.0 + y / (x + abs(y))) / 2.0
    i, j = min(int(row), 62), min(int(column), 62)
    near = np.array([1.0 - (row - i), row - i])
    s = near @ stored[i : i + 2, j : j + 2].astype(np.float64) @ np.array([1.0 - (column - j), column - j])
    h = min(np.sin(np.radians(40.0)), np.sqrt((1.0 - r * r) / (4.0 * (a + b) * c)))
    f = a + b * np.exp(1j * np.radians(150.0))
    cosine = min(max((r * r - abs(f) ** 2 - c * c) / (2.0 * abs(f) * c), -1.0), 1.0)
    least = max(0.0, np.sin((np.angle(f) - np.radians(150.0) + np.arccos(cosine)) / 2.0))
    least = min(least, h)
    d = 2.0 * np.arcsin(least + s * (h - least))
    w = b + c * np.exp(1j * d)
    m = (a * a + r * r - abs(w) ** 2) / (2.0 * r * r)
    elbow = p * (m - 1j * np.sqrt(a * a / r**2 - m * m))
    forearm = (p - elbow) / w
    wrist = elbow + b * forearm
    return [elbow, wrist, wrist + c * forearm * np.exp(1j * d)]


@given(st.sampled_from(ARM_PROPORTIONS), st.floats(0.001, 1.3), st.floats(-1.3, 1.3))
def test_arms_equal_the_specification(proportions: Proportions, x: float, y: float) -> None:
    stored = bend_table.load_bend_table(proportions.identity)
    solved = arm_batch.solve_arms(proportions, stored, np.array([[0.0, y, x]]))
    expected = solve_by_specification(proportions, stored, x, y)
    for joint, position in zip((solved.elbow, solved.wrist, solved.tip), expected, strict=True):
        assert abs(joint[0, 2] + 1j * joint[0, 1] - position) < 1e-9


@settings(max_examples=25)
@given(st.integers(100, 780), st.data())
def test_tip_is_exact_for_any_valid_proportions(upper: int, data: st.DataObject) -> None:
    fore = data.draw(st.integers(100, 980 - upper))
    upper_mass = data.draw(st.integers(1, 998))
    forearm_mass = data.draw(st.integers(1, 999 - upper_mass))
    identity = f"{upper}-{fore}-{1000 - upper - fore}-{upper_mass}-{forearm_mass}-{1000 - upper_mass - forearm_mass}"
    proportions = Proportions.parse(identity)
    targets = random_tips(proportions, 2_000, seed=upper)
    solved = arm_batch.solve_arms(proportions, bend_table.load_bend_table(identity), targets)
    assert float(np.abs(solved.tip - targets).max()) < 1e-14
    t0, t1, t2 = solved.angles()
    assert -1e-9 <= (t1 - t0).min() <= (t1 - t0).max() <= MAX_ELBOW_BEND_RAD + 1e-9
    assert -1e-9 <= (t2 - t1).min() <= (t2 - t1).max() <= MAX_WRIST_BEND_RAD + 1e-9
