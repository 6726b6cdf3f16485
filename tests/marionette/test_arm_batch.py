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

places = st.tuples(*[st.floats(-1.5, 1.5)] * 3)


@pytest.mark.parametrize("proportions", ARM_PROPORTIONS, ids=lambda p: p.identity)
def test_the_tip_is_exact_and_the_joints_are_within_their_limits(proportions: Proportions) -> None:
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
    sizes = np.linalg.norm(links, axis=2)
    np.testing.assert_allclose(sizes, np.array(proportions.lengths)[:, None] * np.ones(len(targets)), atol=1e-12)


@pytest.mark.parametrize("proportions", ARM_PROPORTIONS, ids=lambda p: p.identity)
def test_the_arm_hangs_as_low_as_any_other_bend_would(proportions: Proportions) -> None:
    targets = random_tips(proportions, 500, seed=2)
    solved = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), targets)
    r = np.linalg.norm(targets, axis=1)
    beta = np.arcsin(targets[:, 1] / r)
    low, high = wrist_bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, 400)[:, None]
    every = bend_table.potential(proportions, r, beta, low + shares * (high - low))
    _, t1, t2 = solved.angles()
    here = bend_table.potential(proportions, r, beta, t2 - t1)
    above = here - every.min(axis=0)
    # a few hundredths of a degree from the minimum cost next to nothing; the corners near the shoulder are coarser
    assert float(np.percentile(above, 98)) < 1e-4
    assert float(above.max()) < 1e-3


@given(st.sampled_from(ARM_PROPORTIONS), places)
def test_one_arm_at_a_time_gives_the_same(proportions: Proportions, place: tuple[float, float, float]) -> None:
    stored = bend_table.load_bend_table(proportions.identity)
    target = np.array([place])
    solved = arm_batch.solve_arms(proportions, stored, target)
    one = Arm(proportions, stored)
    rho, y = float(np.hypot(target[0, 0], target[0, 2])), float(target[0, 1])
    beta = float(np.arctan2(y, rho)) if np.hypot(rho, y) >= 1e-12 else -np.pi / 2.0
    angles = one.solve_angles(one.clamp_distance(float(np.hypot(rho, y))), beta)
    np.testing.assert_allclose(angles, np.array(solved.angles())[:, 0], atol=1e-11)


@given(st.sampled_from(ARM_PROPORTIONS), places)
def test_out_of_reach_keeps_the_direction(proportions: Proportions, place: tuple[float, float, float]) -> None:
    target = np.array([place])
    size = float(np.linalg.norm(target))
    tip = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), target).tip[0]
    reach = min(max(size, proportions.min_tip_distance), MAX_TIP_DISTANCE)
    wanted = target[0] / size * reach if size >= 1e-12 else np.array([0.0, -reach, 0.0])
    np.testing.assert_allclose(tip, wanted, atol=1e-9)


@given(st.sampled_from(ARM_PROPORTIONS), places, st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_a_small_step_of_the_hand_is_a_small_step_of_the_arm(
    proportions: Proportions, place: tuple[float, float, float], step: tuple[float, float, float]
) -> None:
    """No jumps, away from the axis and from the straight arm: at most 12 radians of bend per arm length."""
    here = np.array([place])
    there = here + 1e-4 * np.array([step])
    rho = np.hypot(here[:, 0], here[:, 2])
    size = float(np.linalg.norm(here))
    if rho < 0.02 or size > 0.97:
        return
    stored = bend_table.load_bend_table(proportions.identity)
    a, b = arm_batch.solve_arms(proportions, stored, here), arm_batch.solve_arms(proportions, stored, there)
    bends = [np.diff(np.array(solved.angles()), axis=0) for solved in (a, b)]
    moved = float(np.abs(bends[0] - bends[1]).max())
    assert moved <= 12.0 * 1e-4 * np.sqrt(3.0) / max(min(size, 1.0), 0.1)


def test_straight_below_faces_forwards() -> None:
    proportions = ARM_PROPORTIONS[0]
    solved = arm_batch.solve_arms(
        proportions, bend_table.load_bend_table(proportions.identity), np.array([[0.0, -0.7, 0.0], [0.0, 0.0, 0.0]])
    )
    assert solved.azimuth.tolist() == [0.0, 0.0]
    assert solved.elbow[0, 2] < 0.0  # the elbow points back as a forearm is lifted forwards
    np.testing.assert_allclose(solved.tip[1], [0.0, -proportions.min_tip_distance, 0.0], atol=1e-12)


def solve_by_specification(proportions: Proportions, stored: BendTable, x: float, y: float) -> list[complex]:
    """Elbow, wrist and tip as `proto/SPEC.md` says it ("Arm table"), word by word."""
    a, b, c = proportions.lengths
    inner = min(
        abs(a + rest * np.exp(1j * min(np.radians(150.0), np.pi - np.angle(rest))))
        for rest in (b + c * np.exp(1j * np.radians(degrees)) for degrees in range(81))
    )
    inner = max(0.1, 1.25 * inner)
    size = np.hypot(x, y)
    r = min(max(size, inner), 1.0 - 1e-6)
    p = (x + 1j * y) * r / size
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
def test_arms_are_as_the_contract_says(proportions: Proportions, x: float, y: float) -> None:
    stored = bend_table.load_bend_table(proportions.identity)
    solved = arm_batch.solve_arms(proportions, stored, np.array([[0.0, y, x]]))
    wanted = solve_by_specification(proportions, stored, x, y)
    for joint, place in zip((solved.elbow, solved.wrist, solved.tip), wanted, strict=True):
        assert abs(joint[0, 2] + 1j * joint[0, 1] - place) < 1e-9


@settings(max_examples=25)
@given(st.integers(100, 780), st.data())
def test_any_arm_there_is_a_table_for_is_exact(upper: int, data: st.DataObject) -> None:
    fore = data.draw(st.integers(100, 980 - upper))
    heavy = data.draw(st.integers(1, 998))
    middle = data.draw(st.integers(1, 999 - heavy))
    identity = f"{upper}-{fore}-{1000 - upper - fore}-{heavy}-{middle}-{1000 - heavy - middle}"
    proportions = Proportions.parse(identity)
    targets = random_tips(proportions, 2_000, seed=upper)
    solved = arm_batch.solve_arms(proportions, bend_table.load_bend_table(identity), targets)
    assert float(np.abs(solved.tip - targets).max()) < 1e-14
    t0, t1, t2 = solved.angles()
    assert -1e-9 <= (t1 - t0).min() <= (t1 - t0).max() <= MAX_ELBOW_BEND_RAD + 1e-9
    assert -1e-9 <= (t2 - t1).min() <= (t2 - t1).max() <= MAX_WRIST_BEND_RAD + 1e-9
