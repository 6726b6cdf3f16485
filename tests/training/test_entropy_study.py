from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bunraku.codec.motion_encoder import measure_level
from bunraku.codec.prior import CHANNEL_AXES, FEATURE_COUNT, load_shipped_prior
from tests.vectors.blocks import random_motion
from training import entropy_study


def write_clip(folder: Path, name: str, fps: float) -> None:
    motion = random_motion(1.0, fps, 3)
    (folder / "hanim19").mkdir(exist_ok=True)
    np.savez(
        folder / "hanim19" / f"{name}.npz",
        fps=fps,
        off=motion.figure.offsets,
        tip=motion.figure.tips,
        root=motion.root,
        Q=motion.rotations,
    )


def test_family_contributes_its_blocks_and_the_same_again(tmp_path: Path) -> None:
    write_clip(tmp_path, "a", 120.0)
    write_clip(tmp_path, "b", 30.0)
    first, second = (
        entropy_study.collect_family(tmp_path, "x", ["a", "b"], 16, load_shipped_prior()) for _ in range(2)
    )
    for array, again in zip(first, second, strict=True):
        np.testing.assert_array_equal(array, again)
    assert first[0].shape[1] == FEATURE_COUNT
    assert len(first[1]) % CHANNEL_AXES == 0


@pytest.mark.parametrize("error", entropy_study.MEAN_ERRORS_MM)
def test_evaluated_blocks_are_near_the_mean_error(error: float) -> None:
    motion = random_motion(2.0, 30.0, 3)
    track, blocks = entropy_study.encode_near_mean_error(motion, error, load_shipped_prior())
    assert measure_level(track, motion, blocks, np.inf).mean_error_mm == pytest.approx(error, rel=0.15)
