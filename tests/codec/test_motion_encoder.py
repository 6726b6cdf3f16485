from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import (
    ERROR_BOUNDS_MM,
    EncodedMotion,
    EncodingGrade,
    encode_motion,
    encode_motion_to_mean_error,
    measure_level,
)
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, Figure, Motion, joint_and_tip_positions
from tests.vectors.blocks import random_motion


def load_clip(shared: Path, name: str) -> Motion:
    clip = np.load(shared / "mocap" / "hanim19" / f"{name}.npz")
    arrays = {key: clip[key].astype(np.float64) for key in ("off", "tip", "root", "Q")}
    return Motion(Figure(arrays["off"], arrays["tip"]), float(clip["fps"]), arrays["root"], arrays["Q"])


def decoded_points(encoded: EncodedMotion, level: int) -> np.ndarray:
    """Return the world points of all frames as a viewer decodes them."""
    blocks = [decode_motion_block(encoded.track, data) for data in encoded.ladder[level].blocks]
    poses = [block.pose_at(np.arange(block.frames, dtype=np.float64)) for block in blocks]
    return joint_and_tip_positions(encoded.track.figure, *(np.concatenate(part) for part in zip(*poses, strict=True)))


@pytest.mark.parametrize("grade", ["live", "best"])
def test_bitrates_rise_and_every_level_meets_its_bound(grade: str) -> None:
    motion = random_motion(3.2, 30.0, 5)
    encoded = encode_motion(motion, grade=grade)  # type: ignore[arg-type]
    assert len(encoded.ladder) == len(ERROR_BOUNDS_MM) >= 5
    assert [level.kbps for level in encoded.ladder] == sorted(level.kbps for level in encoded.ladder)
    truth = joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
    for number, (level, bound) in enumerate(zip(encoded.ladder, ERROR_BOUNDS_MM, strict=True)):
        error = np.linalg.norm(decoded_points(encoded, number) - truth, axis=-1) * 1e3
        assert error.max() <= bound == level.error_bound_mm
        assert level.max_error_mm == pytest.approx(error.max())
        assert level.mean_error_mm == pytest.approx(error.mean())


@pytest.mark.parametrize("fps", [24.0, 29.97, 120.0])
@pytest.mark.parametrize("block_seconds", [0.25, 0.5, 1.0, 2.0])
def test_blocks_of_any_length_meet_the_bound(fps: float, block_seconds: float) -> None:
    motion = random_motion(2.3, fps, 6)
    encoded = encode_motion(motion, block_seconds, error_bounds_mm=(4.0,), grade="live", first_seconds=0.2)
    # a motion of one block has no short first block
    assert encoded.track.first_frames == (round(0.2 * fps) if block_seconds < 2 else motion.frame_count)
    truth = joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
    assert np.linalg.norm(decoded_points(encoded, 0) - truth, axis=-1).max() <= 4e-3


def test_jumps_at_block_borders_are_within_the_bound() -> None:
    """Each frame is at most the bound off, so velocity and acceleration differ by at most two and four bounds."""
    motion, bound = random_motion(3.0, 60.0, 12), 5e-3
    encoded = encode_motion(motion, 0.5, error_bounds_mm=(bound * 1e3,))
    truth, decoded = joint_and_tip_positions(motion.figure, motion.root, motion.rotations), decoded_points(encoded, 0)
    for index in range(1, encoded.track.block_count):
        border = encoded.track.first_frame(index)
        for order in (1, 2):
            part = slice(border - 2, border + 2)
            difference = np.diff(decoded[part], order, axis=0) - np.diff(truth[part], order, axis=0)
            assert np.linalg.norm(difference, axis=-1).max() <= 2**order * bound


def test_mean_error_is_met_and_not_exceeded() -> None:
    _, level = encode_motion_to_mean_error(random_motion(3.2, 30.0, 5), 2.0)
    assert 1.8 < level.mean_error_mm <= 2.0


def test_still_pose_costs_at_most_30_bytes_per_block() -> None:
    motion = random_motion(4.0, 30.0, 5)
    still = Motion(motion.figure, 30.0, np.tile(motion.root[:1], (90, 1)), np.tile(motion.rotations[:1], (90, 1, 1)))
    for level in encode_motion(still).ladder:
        assert max(map(len, level.blocks)) <= 30


def test_single_frame_can_be_encoded() -> None:
    motion = random_motion(4.0, 30.0, 5)
    assert encode_motion(Motion(motion.figure, 30.0, motion.root[:1], motion.rotations[:1])).track.block_count == 1


def test_progress_rises_to_one() -> None:
    progress: list[float] = []
    encode_motion(random_motion(2.0, 30.0, 5), grade="live", on_progress=progress.append)
    assert progress == sorted(progress)
    assert progress[-1] == 1.0


@pytest.mark.parametrize(
    ("grade", "bound", "grid"),
    [("best", 0.2, 0), ("best", 0.5, 1), ("best", 2.0, 1), ("best", 20.0, 4), ("live", 0.5, 0)],
)
def test_grid_of_the_figure_follows_the_finest_bound(grade: EncodingGrade, bound: float, grid: int) -> None:
    encoded = encode_motion(random_motion(0.3, 30.0, 6), error_bounds_mm=(60.0, bound), grade=grade)
    assert encoded.track.skeleton.grid == grid


def still_body(frames: int, seed: int, metres: float, radians: float) -> Motion:
    """Return a motion whose root wanders by `metres`, and whose joints tremble by `radians`, per frame."""
    rng = np.random.default_rng(seed)
    pose = random_motion(1.0, 60.0, seed)
    root = pose.root[:1] + np.cumsum(rng.normal(0.0, metres, (frames, 3)), axis=0)
    trembling = rotation.from_rotation_vector(rng.normal(0.0, radians, (frames, JOINT_COUNT, 3)))
    return Motion(pose.figure, 60.0, root, rotation.multiply(trembling, pose.rotations[:1]))


@pytest.mark.parametrize("grade", ["live", "best"])
@pytest.mark.parametrize("metres", [0.0, 1e-5, 1e-3, 0.03])
@pytest.mark.parametrize("radians", [0.0, 1e-5, 1e-4, 1e-3])
def test_every_bound_is_met_by_a_body_that_moves_as_a_whole(
    grade: EncodingGrade, metres: float, radians: float
) -> None:
    """The first fault seen was that of a live performer whose root alone moved."""
    for seed in range(3):
        motion = still_body(70, seed, metres, radians)
        for level in encode_motion(motion, error_bounds_mm=(60.0, 0.5), grade=grade).ladder:
            assert level.max_error_mm <= level.error_bound_mm


def test_root_that_alone_moves_costs_no_bits_of_joints() -> None:
    level = encode_motion(still_body(60, 1, 2e-3, 0.0), error_bounds_mm=(0.5,)).ladder[0]
    moving = encode_motion(still_body(60, 1, 2e-3, 1e-2), error_bounds_mm=(0.5,)).ladder[0]
    assert 4 * level.kbps < moving.kbps


def test_threads_encode_the_same_bytes() -> None:
    motion = random_motion(2.0, 30.0, 5)
    serial = encode_motion(motion, error_bounds_mm=(20.0, 5.0, 60.0))
    with ThreadPoolExecutor(3) as pool:
        parallel = encode_motion(motion, error_bounds_mm=(20.0, 5.0, 60.0), map_levels=pool.map)
    assert [level.blocks for level in serial.ladder] == [level.blocks for level in parallel.ladder]
    assert [level.error_bound_mm for level in parallel.ladder] == [20.0, 5.0, 60.0]


def test_level_beyond_its_bound_is_refused() -> None:
    motion = random_motion(1.0, 30.0, 5)
    encoded = encode_motion(motion, error_bounds_mm=(20.0,))
    with pytest.raises(ValueError, match=r"0\.001"):
        measure_level(encoded.track, motion, encoded.ladder[0].blocks, 0.001)


def test_bitrates_of_a_recorded_dance(shared: Path) -> None:
    ladder = encode_motion(load_clip(shared, "perfume_A")).ladder
    assert ladder[0].kbps < 0.8
    assert ladder[2].kbps < 2.5
    assert ladder[4].kbps < 8.0
