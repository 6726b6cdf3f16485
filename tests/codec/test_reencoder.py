from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM, BitrateLevel, EncodedMotion, encode_motion
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.reencoder import reencode_lower_levels
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Motion, joint_and_tip_positions
from tests.vectors.blocks import random_motion

SOURCE = random_motion(3.2, 30.0, 5)


@pytest.fixture(scope="module")
def stored() -> EncodedMotion:
    """Return a motion as an encoder without refinement stores it."""
    return encode_motion(SOURCE, grade="live", first_seconds=0.5)


def decode(track: MotionTrack, level: BitrateLevel) -> Motion:
    poses = [decode_motion_block(track, data) for data in level.blocks]
    parts = [block.pose_at(np.arange(block.frames, dtype=np.float64)) for block in poses]
    root, rotations = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Motion(track.figure, track.fps, root, rotations)


def errors_mm(track: MotionTrack, level: BitrateLevel) -> Array:
    decoded, source = (
        joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
        for motion in (decode(track, level), SOURCE)
    )
    errors: Array = np.linalg.norm(decoded - source, axis=-1) * 1e3
    return errors


def test_levels_get_smaller_and_keep_their_bounds_against_the_source(stored: EncodedMotion) -> None:
    progress: list[float] = []
    decoded = decode(stored.track, stored.ladder[-1])
    after = reencode_lower_levels(stored.track, decoded, stored.ladder, on_progress=progress.append)
    assert after[-1] is stored.ladder[-1]
    assert [level.error_bound_mm for level in after] == list(ERROR_BOUNDS_MM)
    for before, level in zip(stored.ladder[:-1], after, strict=False):
        assert level.kbps < before.kbps
        assert all(len(new) <= len(old) for new, old in zip(level.blocks, before.blocks, strict=True))
        found = errors_mm(stored.track, level)
        assert found.max() <= level.error_bound_mm
        assert found.mean() <= level.mean_error_mm
    assert progress == sorted(progress)
    assert progress[-1] == 1.0
    # each time from the same highest level: nothing changes any more, and errors do not add up
    assert reencode_lower_levels(stored.track, decoded, after) == after


def test_ladder_of_one_level_stays(stored: EncodedMotion) -> None:
    ladder = stored.ladder[-1:]
    assert reencode_lower_levels(stored.track, decode(stored.track, ladder[0]), ladder) == ladder
