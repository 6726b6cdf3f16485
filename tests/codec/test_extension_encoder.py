from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.extension_encoder import encode_extension
from bunraku.codec.extension_track import decode_extension_block
from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM, encode_motion
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import extend_pose
from bunraku.motion.skeleton import world_transforms
from tests.motion.extended_source import extended_source

ANALYSIS = analyse(extended_source(150, swing=0.4))
assert ANALYSIS.extension is not None
EXTENSION, VALUES = ANALYSIS.extension.extension, ANALYSIS.extension.values
MOTION = encode_motion(ANALYSIS.motion, first_seconds=0.5, grade="live")
ENCODED = encode_extension(EXTENSION, VALUES, MOTION.track)


def test_levels_grow_and_share_the_blocks_of_the_motion() -> None:
    assert len(ENCODED.ladder) == len(MOTION.ladder) == len(ERROR_BOUNDS_MM)
    assert all(len(level.blocks) == MOTION.track.block_count for level in ENCODED.ladder)
    rates = [level.kbps for level in ENCODED.ladder]
    assert rates == sorted(rates)
    for level, bound in zip(ENCODED.ladder, ERROR_BOUNDS_MM, strict=True):
        assert level.max_error_mm <= level.error_bound_mm < bound


@pytest.mark.parametrize("level", [2, 4])
def test_decoded_joints_are_near_those_of_the_source(level: int) -> None:
    track, motion = ENCODED.track, ANALYSIS.motion
    values = np.concatenate(
        [
            decode_extension_block(track, data).values_at(np.arange(float(track.frames_in(index))))
            for index, data in enumerate(ENCODED.ladder[level].blocks)
        ]
    )
    placed = world_transforms(motion.figure, motion.root, motion.rotations)
    truth = extend_pose(motion.figure, EXTENSION, *placed, VALUES)
    decoded = extend_pose(motion.figure, EXTENSION, *placed, values)
    apart = 1e3 * np.linalg.norm(decoded.extra_positions - truth.extra_positions, axis=-1)
    assert apart.max() <= 2 * ERROR_BOUNDS_MM[level]
    assert apart.mean() <= 0.5 * ERROR_BOUNDS_MM[level]


def test_bound_that_cannot_be_met_is_an_error() -> None:
    with pytest.raises(ValueError, match="finest step"):
        encode_extension(EXTENSION, VALUES, MOTION.track, error_bounds_mm=(1e-9,))
