from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import prior
from bunraku.codec.block_encoder import (
    MEAN_ERROR_REFINEMENT,
    BlockEncoder,
    EncodingGrade,
    error_bound_refinement,
)
from bunraku.codec.block_input import Refinement
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.vectors.blocks import random_motion

MOTION = random_motion(2.2, 30.0, 3)
TRACK = plan_motion_track(MOTION)
ENCODER = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior())


@pytest.mark.parametrize("refinement", [None, MEAN_ERROR_REFINEMENT, error_bound_refinement(0.0)])
def test_reported_error_is_that_of_the_decoded_bytes(refinement: Refinement | None) -> None:
    encoded = ENCODER.encode_block(1, 110, refinement)
    block = decode_motion_block(TRACK, encoded.data)
    start = TRACK.first_frame(1)
    part = slice(start, start + block.frames)
    truth = joint_and_tip_positions(TRACK.figure, MOTION.root[part], MOTION.rotations[part])
    decoded = joint_and_tip_positions(TRACK.figure, *block.pose_at(np.arange(float(block.frames))))
    error = np.linalg.norm(decoded - truth, axis=-1) * 1e3
    np.testing.assert_allclose(encoded.errors_mm, error.T, atol=1e-6)


def test_refinement_lowers_bytes_times_error() -> None:
    single_pass, refined = (ENCODER.encode_block(0, 112, refinement) for refinement in (None, MEAN_ERROR_REFINEMENT))
    assert len(refined.data) * refined.errors_mm.mean() < len(single_pass.data) * single_pass.errors_mm.mean()


def test_bound_is_met_with_fewer_bytes_than_by_finer_steps_alone() -> None:
    for index, bound in ((0, 1.5), (1, 3.0)):
        blocks = [ENCODER.encode_block(index, step, MEAN_ERROR_REFINEMENT) for step in range(76, 124, 2)]
        smallest = min(len(block.data) for block in blocks if block.errors_mm.max() <= bound)
        assert len(ENCODER.encode_within_bound(index, bound, "best").data) < smallest


@pytest.mark.parametrize("grade", ["live", "best"])
@pytest.mark.parametrize("bound", [0.3, 5.0, 80.0])
def test_largest_error_is_within_the_bound(grade: EncodingGrade, bound: float) -> None:
    encoded = ENCODER.encode_within_bound(0, bound, grade)
    assert encoded.errors_mm.max() <= bound
    if grade == "best":
        assert encoded.errors_mm.max() > 0.5 * bound


def test_mean_error_is_approached_from_below() -> None:
    for mean in (0.4, 3.0):
        error = np.concatenate([block.errors_mm for block in ENCODER.encode_to_mean_error(mean)], axis=1)
        assert 0.8 * mean < error.mean() <= mean


def test_unreachable_errors_are_refused() -> None:
    with pytest.raises(ValueError, match="Block 1 cannot be encoded within 1e-05 mm"):
        ENCODER.encode_within_bound(1, 1e-5, "live")
    with pytest.raises(ValueError, match="mean error of 1e-05 mm"):
        ENCODER.encode_to_mean_error(1e-5)
