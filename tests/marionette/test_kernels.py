from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.kernels import load_kernels
from bunraku.marionette import arm_batch, bend_table
from bunraku.marionette.controlled_limb import ControlledHand
from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.vector import ZERO
from bunraku.motion import rotation
from bunraku.motion.skeleton import standard_figure
from bunraku.runtime.compile_cache import compile_cache_folder
from tests.marionette.fixtures import ARM_PROPORTIONS

KERNELS = load_kernels("marionette")
coordinates = st.one_of(st.floats(-1.5, 1.5), st.floats(-1e6, 1e6), st.sampled_from([0.0, -0.0, 1e-170, 1.0]))
HANDS_AND_SEEDS = [(limb, seed) for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND) for seed in range(3)]


@given(st.sampled_from(ARM_PROPORTIONS), st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=20))
def test_compiled_arms_equal_plain_arms(proportions: Proportions, positions: list[tuple[float, float, float]]) -> None:
    table, targets = bend_table.load_bend_table(proportions.identity), np.array(positions).reshape(-1, 3)
    plain, compiled = arm_batch.solve_arms(proportions, table, targets), KERNELS.solve_arms(proportions, table, targets)
    np.testing.assert_allclose(compiled.rows, plain.rows, rtol=0.0, atol=1e-12)


@pytest.fixture(scope="module")
def compiled_solver() -> LimbSolver:
    solver: LimbSolver = KERNELS.compile_solver(compile_cache_folder("marionette"))
    return solver


def solve_sequence(limb: Limb, seed: int, first: LimbSolver, second: LimbSolver, switch_frame: int = 0) -> list[Any]:
    """Control a hand of a turning body with random targets, then release it; the solver changes at a frame."""
    random = np.random.default_rng(seed)
    hand = ControlledHand(standard_figure(), limb, first)
    pose = rotation.from_rotation_vector(random.uniform(-0.5, 0.5, (18, 3)))
    results: list[Any] = []
    for frame in range(240):
        if frame == switch_frame:
            hand.use_solver(second)
        if frame % 12 == 0:
            x, y, z = random.uniform(-1.2, 1.2, 3).tolist()
        pose[0] = rotation.from_rotation_vector(np.array([0.02, 0.05, 0.01]) * frame)
        hand.observe_pose(pose.tolist(), 1 / 60)
        is_held = frame < 200
        weight = min(frame / 9, 1.0) if is_held else 0.1
        results.append(hand.solve_joints(pose.tolist(), (x, y, z) if is_held else None, weight, 1 / 60))
        results.append(hand.position)
    return results


@pytest.mark.parametrize(("limb", "seed"), HANDS_AND_SEEDS)
def test_compiled_solver_equals_plain_solver_to_the_last_bit(
    limb: Limb, seed: int, compiled_solver: LimbSolver
) -> None:
    plain = solve_sequence(limb, seed, PYTHON_SOLVER, PYTHON_SOLVER)
    assert solve_sequence(limb, seed, compiled_solver, compiled_solver) == plain
    assert solve_sequence(limb, seed, PYTHON_SOLVER, compiled_solver, switch_frame=100) == plain


def test_switch_reaches_every_part_of_a_hand(compiled_solver: LimbSolver) -> None:
    hand = ControlledHand(standard_figure(), Limb.LEFT_HAND)
    pose = rotation.from_rotation_vector(np.zeros((18, 3))).tolist()
    hand.observe_pose(pose, 0.02)
    hand.solve_joints(pose, (0.2, 0.1, 0.4), 0.5, 0.02)
    hand.use_solver(compiled_solver)
    assert hand._follower is not None
    parts = (hand.rig, hand._elbow, hand._follower, hand._blend._twist_limiter)
    assert all(part.solver is compiled_solver for part in parts)
    hand.reset()
    assert hand._elbow.solver is compiled_solver


def test_argument_of_another_type_raises_without_compiling(compiled_solver: LimbSolver) -> None:
    with pytest.raises(TypeError, match="No matching definition"):
        compiled_solver.advance("here", ZERO, ZERO, ZERO, ZERO, ZERO, 0.02, 1.0, 0.0, 1.0)  # type: ignore[arg-type]
