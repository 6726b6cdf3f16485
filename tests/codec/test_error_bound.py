from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import _kernels, prior
from bunraku.codec._kernels import error_bound, rate_distortion
from bunraku.codec.block_encoder import BlockEncoder, EncodedBlock, error_bound_refinement
from bunraku.codec.block_input import BlockInput, Refinement
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINTS, Motion
from tests.vectors.blocks import random_motion

MOTION = random_motion(1.0, 30.0, 3)


def encode_at_all_steps(motion: Motion, bound_mm: float) -> list[EncodedBlock]:
    encoder = BlockEncoder(plan_motion_track(motion), motion, prior.load_shipped_prior())
    return [encoder.encode_block(0, step, error_bound_refinement(bound_mm)) for step in range(80, 180, 4)]


def encode_with_second_pass_alone(
    motion: Motion, bound_mm: float, monkeypatch: pytest.MonkeyPatch
) -> list[EncodedBlock]:
    def refine(block: BlockInput, q: prior.IntArray, refinement: Refinement) -> rotation.Array:
        points: rotation.Array = rate_distortion.refine_coefficients(block, q, refinement._replace(max_sweeps=8))
        return points

    with monkeypatch.context() as patch:
        patch.setattr(_kernels, "refine_within_bound", refine)
        blocks = encode_at_all_steps(motion, bound_mm)
        assert all(block.data for block in blocks)
    return blocks


def smallest_valid(blocks: list[EncodedBlock], bound_mm: float) -> int:
    return min(len(block.data) for block in blocks if block.errors_mm.max() <= bound_mm)


@pytest.mark.parametrize("bound_mm", [2.0, 10.0])
def test_third_pass_saves_a_tenth_of_the_bytes(bound_mm: float, monkeypatch: pytest.MonkeyPatch) -> None:
    second_pass = smallest_valid(encode_with_second_pass_alone(MOTION, bound_mm, monkeypatch), bound_mm)
    assert smallest_valid(encode_at_all_steps(MOTION, bound_mm), bound_mm) < 0.9 * second_pass


def test_jump_of_a_toe_in_one_frame_costs_few_bytes() -> None:
    """A rotation by 20 degrees in a single frame, as capture systems have them, does not decide the block's step."""
    rotations = MOTION.rotations.copy()
    toe = JOINTS.index("l_midtarsal")
    jump = rotation.from_rotation_vector(np.array([np.radians(20.0), 0.0, 0.0]))
    rotations[17, toe] = rotation.multiply(rotations[17, toe], jump)
    motion = Motion(MOTION.figure, MOTION.fps, MOTION.root, rotations)
    without, with_jump = (smallest_valid(encode_at_all_steps(m, 10.0), 10.0) for m in (MOTION, motion))
    assert with_jump < 1.2 * without


def test_slope_equals_a_finite_difference_and_the_tangent_is_a_lower_limit() -> None:
    random = np.random.default_rng(4)
    moved = np.array([3, 7, 20])
    errors = error_bound._Errors(
        random.normal(0, 0.7, (23, 3, 30)), random.normal(0, 1, (23, 3, 30)), np.zeros(30), np.zeros(23)
    )
    error_bound._update_slopes(moved, errors)
    cosines = np.cos(np.pi / 30 * (np.arange(30) + 0.5) * 3)
    gradient = float(cosines @ errors.slope)
    up, down = (error_bound._penalty_added(moved, errors, cosines, delta, np.inf) for delta in (1e-6, -1e-6))
    assert (up - down) / 2e-6 == pytest.approx(gradient, rel=1e-4)
    for delta in (-1.0, -0.1, 0.1, 1.0):
        added = error_bound._penalty_added(moved, errors, cosines, delta, np.inf)
        assert added >= delta * gradient
        assert error_bound._penalty_added(moved, errors, cosines, delta, added + 1) == pytest.approx(added)
        assert error_bound._penalty_added(moved, errors, cosines, delta, added - 1) > added - 1


def test_fine_steps_meet_the_bound() -> None:
    for block in encode_at_all_steps(MOTION, 5.0):
        if block.step < 100:
            assert block.errors_mm.max() <= 5.0
