from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.extension.body_joints import pack_body
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.track import decode_extension_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import extend_pose
from bunraku.motion.skeleton import world_transforms
from tests.motion.extended_source import extended_source

ANALYSIS = analyse(extended_source(150, swing=0.4))
assert ANALYSIS.extension is not None
EXTENSION, VALUES = ANALYSIS.extension.extension, ANALYSIS.extension.values
MOTION = encode_motion(ANALYSIS.motion, first_seconds=0.5, grade="live")
ENCODED = encode_extension(EXTENSION, VALUES, MOTION.track, [level.mean_error_mm for level in MOTION.ladder])


def test_levels_grow_and_share_the_blocks_of_the_motion() -> None:
    assert all(len(level.blocks) == MOTION.track.block_count for level in ENCODED.ladder)
    rates = [level.kbps for level in ENCODED.ladder]
    assert rates == sorted(rates)
    errors = [level.mean_error_mm for level in ENCODED.ladder]
    assert errors == sorted(errors, reverse=True)
    for level, motion_level in zip(ENCODED.ladder, MOTION.ladder, strict=True):
        assert level.mean_error_mm < 1.5 * motion_level.mean_error_mm
        assert level.max_error_mm <= level.error_bound_mm + 1e-3


@pytest.mark.parametrize("level", range(5))
def test_decoded_joints_are_as_near_as_those_of_the_motion(level: int) -> None:
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
    assert apart.mean() <= 1.5 * MOTION.ladder[level].mean_error_mm


def test_extension_of_a_swinging_dance_costs_a_third_of_the_motion_at_most() -> None:
    added = sum(map(len, ENCODED.ladder[2].blocks)) + len(pack_body(EXTENSION))
    assert added <= 0.34 * sum(map(len, MOTION.ladder[2].blocks))


def test_values_that_are_too_large_are_an_error() -> None:
    with pytest.raises(ValueError, match="too large"):
        encode_extension(EXTENSION, VALUES * 1e9, MOTION.track, [0.01])
