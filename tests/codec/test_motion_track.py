from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_track import (
    HEADING_COUNT,
    describe_motion_track,
    parse_motion_track,
    plan_motion_track,
    step_size,
)
from bunraku.motion.skeleton import Motion
from tests.vectors.blocks import random_motion


@pytest.mark.parametrize("fps", [23.976, 30.0, 40.0, 59.94, 120.0])
@pytest.mark.parametrize("first", [None, 0.3])
def test_blocks_tile_the_motion_evenly(fps: float, first: float | None) -> None:
    motion = random_motion(3.3, fps, 2)
    track = plan_motion_track(motion, first_seconds=first)
    assert sum(track.frames_in(i) for i in range(track.block_count)) == motion.frame_count
    assert abs(track.block_frames / fps - 1) < 0.15
    assert track.frames_in(track.block_count - 1) >= track.block_frames - track.block_count
    assert track.first_frames == (round(0.3 * fps) if first else track.block_frames)
    for i in range(track.block_count):
        assert track.block_at(track.start_us(i)) == i
        assert i == 0 or track.block_at(track.start_us(i) - 1000) == i - 1
    assert track.block_at(-5) == 0
    assert track.block_at(track.duration_us + 5) == track.block_count - 1


def test_a_little_more_than_a_block_is_one_block() -> None:
    assert plan_motion_track(random_motion(1.3, 30.0, 2)).block_count == 1
    assert plan_motion_track(random_motion(1.3, 30.0, 2), first_seconds=2.0).block_count == 1


def test_headings_follow_the_root_s_turning() -> None:
    motion = random_motion(1.5, 30.0, 4)
    track = plan_motion_track(motion)
    found = [track.nearest_heading(root) for root in motion.rotations[:, 0]]
    assert min(found) >= -HEADING_COUNT // 2
    assert max(found) < HEADING_COUNT // 2
    assert len(set(found)) > 20
    for heading in (-32, 0, 31):
        assert track.nearest_heading(track.reference_rotations(heading)[0]) == heading


def test_a_coarser_error_asks_for_a_coarser_figure() -> None:
    motion = random_motion(1.0, 30.0, 1)
    tracks = [plan_motion_track(motion, mean_error_mm=mean) for mean in (0.1, 1.0, 5.0)]
    assert [track.skeleton.grid for track in tracks] == [0, 2, 4]
    sizes = [len(track.skeleton.pack()) for track in tracks]
    assert sizes == sorted(sizes, reverse=True)


def test_sixteen_steps_are_twice_as_coarse() -> None:
    assert step_size(116, 30) == pytest.approx(2 * step_size(100, 30))
    assert step_size(100, 120) == pytest.approx(2 * step_size(100, 30))


def test_very_high_frame_rates_keep_blocks_within_the_format() -> None:
    still = random_motion(0.01, 240.0, 1)
    motion = Motion(
        still.figure, 5000.0, np.tile(still.root[:1], (4001, 1)), np.tile(still.rotations[:1], (4001, 1, 1))
    )
    track = plan_motion_track(motion)
    assert track.block_frames == 512
    assert sum(track.frames_in(i) for i in range(track.block_count)) == 4001


def test_a_track_survives_its_description() -> None:
    track = plan_motion_track(random_motion(2.0, 29.97, 1), first_seconds=0.5)
    again = parse_motion_track(describe_motion_track(track, []))
    assert (again.fps, again.frames, again.block_frames) == (track.fps, track.frames, track.block_frames)
    assert again.first_frames == track.first_frames
    np.testing.assert_allclose(again.weights, track.weights, atol=1e-12)
    np.testing.assert_allclose(again.reference_rotations(7), track.reference_rotations(7), atol=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("codec", "other/2", "other/2"),
        ("fps", "fast", "numbers"),
        ("fps", 0, "above zero"),
        ("fps", float("nan"), "above zero"),
        ("fps", float("inf"), "at most 100000"),
        ("fps", 5e-324, "2\\^48"),
        ("frames", 1 << 60, "86400 blocks"),
        ("block_frames", 5000, "1..512"),
        ("first_frames", 0, "1..512"),
        ("first_frames", 31, "1..512"),
        ("dancer", "no", "dancer"),
        ("dancer", b"", "bytes"),
    ],
)
def test_a_wrong_description_is_refused(key: str, value: object, says: str) -> None:
    described = describe_motion_track(plan_motion_track(random_motion(1.0, 30.0, 1)), [])
    described[key] = value
    with pytest.raises(DamagedBlock, match=says):
        parse_motion_track(described)
