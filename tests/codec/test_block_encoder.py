from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import prior
from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.vectors.blocks import random_motion

MOTION = random_motion(2.2, 30.0, 3)
TRACK = plan_motion_track(MOTION)
ENCODER = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior())


@pytest.mark.parametrize("goal", ["first", "mean", "most"])
def test_the_error_of_a_block_is_that_of_its_bytes(goal: str) -> None:
    coded = ENCODER.encode_block(1, 110, goal)  # type: ignore[arg-type]
    block = decode_motion_block(TRACK, coded.data)
    start = TRACK.first_frame(1)
    part = slice(start, start + block.frames)
    truth = joint_and_tip_positions(TRACK.figure, MOTION.root[part], MOTION.rotations[part])
    error = (
        np.linalg.norm(
            joint_and_tip_positions(TRACK.figure, *block.pose_at(np.arange(float(block.frames)))) - truth, axis=-1
        )
        * 1e3
    )
    np.testing.assert_allclose(coded.errors_mm, error.T, atol=1e-6)


def test_refining_costs_fewer_bytes_or_errs_less() -> None:
    first, mean = (ENCODER.encode_block(0, 112, goal) for goal in ("first", "mean"))
    assert len(mean.data) * mean.errors_mm.mean() < len(first.data) * first.errors_mm.mean()


def test_a_bound_is_met_with_fewer_bytes_than_by_finer_steps_alone() -> None:
    for index, bound in ((0, 1.5), (1, 3.0)):
        means = [ENCODER.encode_block(index, step, "mean") for step in range(76, 124, 2)]
        plain = min(len(block.data) for block in means if block.errors_mm.max() <= bound)
        assert len(ENCODER.encode_within_bound(index, bound, "best").data) < plain


@pytest.mark.parametrize("grade", ["live", "best"])
@pytest.mark.parametrize("bound", [0.3, 5.0, 80.0])
def test_no_point_is_further_off_than_asked(grade: str, bound: float) -> None:
    coded = ENCODER.encode_within_bound(0, bound, grade)
    assert coded.errors_mm.max() <= bound
    if grade == "best":
        assert coded.errors_mm.max() > 0.5 * bound


def test_means_are_met_from_below() -> None:
    for mean in (0.4, 3.0):
        error = np.concatenate([block.errors_mm for block in ENCODER.encode_to_mean_error(mean)], axis=1)
        assert 0.8 * mean < error.mean() <= mean
