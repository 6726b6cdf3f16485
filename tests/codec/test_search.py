from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import prior
from bunraku.codec.decode import decode_block
from bunraku.codec.search import BlockEncoder
from bunraku.codec.track import plan
from bunraku.motion.skeleton import points
from tests.vectors.blocks import wandering_motion

MOTION = wandering_motion(2.2, 30.0, 3)
TRACK = plan(MOTION)
ENCODER = BlockEncoder(TRACK, MOTION, prior.shipped())


@pytest.mark.parametrize("goal", ["first", "mean", "most"])
def test_the_error_of_a_block_is_that_of_its_bytes(goal: str) -> None:
    coded = ENCODER.block(1, 110, goal)  # type: ignore[arg-type]
    block = decode_block(TRACK, coded.data)
    start = TRACK.first_frame(1)
    part = slice(start, start + block.frames)
    truth = points(TRACK.figure, MOTION.root[part], MOTION.rotations[part])
    error = np.linalg.norm(points(TRACK.figure, *block.at(np.arange(float(block.frames)))) - truth, axis=-1) * 1e3
    np.testing.assert_allclose(coded.error, error.T, atol=1e-6)


def test_refining_costs_fewer_bytes_or_errs_less() -> None:
    first, mean = (ENCODER.block(0, 112, goal) for goal in ("first", "mean"))
    assert len(mean.data) * mean.error.mean() < len(first.data) * first.error.mean()


def test_a_bound_is_met_with_fewer_bytes_than_by_finer_steps_alone() -> None:
    for index, bound in ((0, 1.5), (1, 3.0)):
        means = [ENCODER.block(index, step, "mean") for step in range(76, 124, 2)]
        plain = min(len(block.data) for block in means if block.error.max() <= bound)
        assert len(ENCODER.bounded(index, bound, "best").data) < plain


@pytest.mark.parametrize("grade", ["live", "best"])
@pytest.mark.parametrize("bound", [0.3, 5.0, 80.0])
def test_no_point_is_further_off_than_asked(grade: str, bound: float) -> None:
    coded = ENCODER.bounded(0, bound, grade)
    assert coded.error.max() <= bound
    if grade == "best":
        assert coded.error.max() > 0.5 * bound


def test_means_are_met_from_below() -> None:
    for mean in (0.4, 3.0):
        error = np.concatenate([block.error for block in ENCODER.averaged(mean)], axis=1)
        assert 0.8 * mean < error.mean() <= mean
