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
@pytest.mark.parametrize("first", [None, 0.5])
def test_blocks_cover_the_motion_evenly(fps: float, first: float | None) -> None:
    motion = random_motion(3.3, fps, 2)
    track = plan_motion_track(motion, first_seconds=first)
    assert sum(track.frames_in(i) for i in range(track.block_count)) == motion.frame_count
    assert abs(track.block_frames / fps - (1.4 if first else 1.1)) < 0.05
    assert track.frames_in(track.block_count - 1) >= track.block_frames - track.block_count
    assert track.first_frames == (round(0.5 * fps) if first else track.block_frames)
    for i in range(track.block_count):
        assert track.block_at(track.start_us(i)) == i
        assert i == 0 or track.block_at(track.start_us(i) - 1000) == i - 1
    assert track.block_at(-5) == 0
    assert track.block_at(track.duration_us + 5) == track.block_count - 1


def test_motion_slightly_longer_than_a_block_is_one_block() -> None:
    assert plan_motion_track(random_motion(1.3, 30.0, 2)).block_count == 1
    assert plan_motion_track(random_motion(1.3, 30.0, 2), first_seconds=2.0).block_count == 1


def test_heading_follows_the_root() -> None:
    motion = random_motion(1.5, 30.0, 4)
    track = plan_motion_track(motion)
    headings = [track.nearest_heading(root) for root in motion.rotations[:, 0]]
    assert min(headings) >= -HEADING_COUNT // 2
    assert max(headings) < HEADING_COUNT // 2
    assert len(set(headings)) > 20
    for heading in (-32, 0, 31):
        assert track.nearest_heading(track.reference_rotations(heading)[0]) == heading


def test_larger_error_gives_a_coarser_grid() -> None:
    motion = random_motion(1.0, 30.0, 1)
    tracks = [plan_motion_track(motion, mean_error_mm=mean) for mean in (0.1, 1.0, 5.0)]
    assert [track.skeleton.grid for track in tracks] == [0, 2, 4]
    sizes = [len(track.skeleton.pack()) for track in tracks]
    assert sizes == sorted(sizes, reverse=True)


def test_step_size_doubles_every_16_indices() -> None:
    assert step_size(116, 30) == pytest.approx(2 * step_size(100, 30))
    assert step_size(100, 120) == pytest.approx(2 * step_size(100, 30))


def test_very_high_frame_rate_keeps_blocks_within_512_frames() -> None:
    still = random_motion(0.01, 240.0, 1)
    motion = Motion(
        still.figure, 5000.0, np.tile(still.root[:1], (4001, 1)), np.tile(still.rotations[:1], (4001, 1, 1))
    )
    track = plan_motion_track(motion)
    assert track.block_frames == 512
    assert sum(track.frames_in(i) for i in range(track.block_count)) == 4001


def test_description_round_trips() -> None:
    track = plan_motion_track(random_motion(2.0, 29.97, 1), first_seconds=0.5)
    parsed = parse_motion_track(describe_motion_track(track, []))
    assert (parsed.fps, parsed.frames, parsed.block_frames) == (track.fps, track.frames, track.block_frames)
    assert parsed.first_frames == track.first_frames
    np.testing.assert_allclose(parsed.weights, track.weights, atol=1e-12)
    np.testing.assert_allclose(parsed.reference_rotations(7), track.reference_rotations(7), atol=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("codec", "other/2", "other/2"),
        ("fps", "fast", "must be a number"),
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
def test_invalid_description_is_refused(key: str, value: object, message: str) -> None:
    description = describe_motion_track(plan_motion_track(random_motion(1.0, 30.0, 1)), [])
    description[key] = value
    with pytest.raises(DamagedBlock, match=message):
        parse_motion_track(description)
