from __future__ import annotations

import gc
from collections import Counter

import numpy as np
import pytest

from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.motion_decoder import MotionBlock, decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.motion_track import MotionTrack
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.playout.timeline import TimelineHistory
from bunraku.session import pose_cache
from bunraku.session.pose_cache import BATCH_FRAMES, PoseCache, shared_block_store
from bunraku.storage.motion_store import MotionStore
from bunraku.wire.messages import Data
from tests.ingest.jobs.motions import MOTIONS
from tests.vectors.blocks import random_motion

STEP_US = 16_667


async def stored_motion() -> StoredMotion:
    store = MotionStore.open("memory:///")
    await store.put(
        "one", pack_motion("one", encode_motion(random_motion(2.3, 30.0, 5), error_bounds_mm=(5.0,), grade="live"))
    )
    motion = await store.get("one")
    assert motion is not None
    return motion


async def test_poses_are_exact_across_block_boundaries_and_the_loop() -> None:
    motion = await stored_motion()
    track = motion.first_track
    timelines = TimelineHistory()
    timelines.put(timeline.start("one", track.duration_us, 1_000_000))
    poses, blocks = PoseCache(motion, timelines), MotionBlockStore(track)
    for index, packet in enumerate(motion.first_packets[-1]):
        blocks.put(index, 0, decode_motion_block(track, Data.unpack(packet).block))
    for frame in range(200):
        due = 1_000_000 + frame * STEP_US
        await poses.decode_blocks(due)
        expected = blocks.pose_at(due - 1_000_000 - (due - 1_000_000) // track.duration_us * track.duration_us)
        found = poses.poses_at(due, STEP_US)
        assert expected is not None
        assert found is not None
        for values, expected_values in zip(found[0], expected, strict=True):
            np.testing.assert_allclose(values, expected_values, atol=1e-12)


async def test_edit_applies_at_once_and_other_motion_has_no_poses() -> None:
    motion = await stored_motion()
    timelines = TimelineHistory()
    first = timeline.start("one", motion.first_track.duration_us, 0)
    timelines.put(first)
    poses = PoseCache(motion, timelines)
    assert poses.poses_at(500_000, STEP_US) is None
    await poses.decode_blocks(500_000)
    moving_poses = poses.poses_at(500_000, STEP_US)
    paused = timeline.edit(first, 500_000, position=200_000, playing=False)
    timelines.put(paused)
    await poses.decode_blocks(500_000)
    still_poses = poses.poses_at(500_000, STEP_US)
    assert moving_poses is not None
    assert still_poses is not None
    assert np.abs(moving_poses[0][1] - still_poses[0][1]).max() > 1e-3
    later_poses = poses.poses_at(500_000 + 40 * STEP_US, STEP_US)
    assert later_poses is not None
    np.testing.assert_array_equal(later_poses[0][1], still_poses[0][1])
    timelines.put(timeline.change_motion(paused, 600_000, "two", 5_000_000))
    await poses.decode_blocks(700_000)
    assert poses.poses_at(700_000, STEP_US) is None


async def test_stages_compute_batches_of_poses_at_different_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = await stored_motion()
    timelines = TimelineHistory()
    timelines.put(timeline.start("one", motion.first_track.duration_us, 0))
    stages = [PoseCache(motion, timelines) for _ in range(50)]
    for poses in stages:
        for due in (0, 1_000_000):
            await poses.decode_blocks(due)
    computed_at: list[int] = []
    computed_poses_at = MotionBlockStore.poses_at

    def counting(store: MotionBlockStore, positions: list[int], loop: bool, duration: int) -> list[Pose | None]:
        computed_at.append(frame)
        return computed_poses_at(store, positions, loop, duration)

    monkeypatch.setattr(MotionBlockStore, "poses_at", counting)
    for frame in range(2 * BATCH_FRAMES):
        for poses in stages:
            assert poses.poses_at(frame * STEP_US, STEP_US) is not None
    # at the first frame every stage computes a batch
    counts = Counter(computed_at[len(stages) :])
    assert sum(counts.values()) >= len(stages)
    assert max(counts.values()) <= 10


async def test_motion_is_decoded_once_and_freed_with_the_last_stage(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    motion, decoded = await stored_motion(), 0

    def counting(track: MotionTrack, data: bytes) -> MotionBlock:
        nonlocal decoded
        decoded += 1
        return decode_motion_block(track, data)

    monkeypatch.setattr(pose_cache, "decode_motion_block", counting)
    timelines = TimelineHistory()
    timelines.put(timeline.start("one", motion.first_track.duration_us, 0))
    stages = [PoseCache(motion, timelines) for _ in range(5)]
    for poses in stages:
        for due in (0, 1_000_000):
            await poses.decode_blocks(due)
            assert poses.poses_at(due, STEP_US) is not None
    assert decoded == motion.first_track.block_count
    other = await stored_motion()
    assert shared_block_store(other.first_track) is not shared_block_store(motion.first_track)
    del stages, poses
    gc.collect()
    assert shared_block_store(motion.first_track).level(0) == -1


async def test_tracks_longer_or_shorter_than_the_motion_have_poses() -> None:
    track = MOTIONS["both"].first_track
    for name, other in (("both", "two"), ("longer", "one")):
        motion = MOTIONS[name]
        timelines = TimelineHistory()
        timelines.put(timeline.start(motion.id, motion.first_track.duration_us, 0))
        poses, blocks = (
            PoseCache(motion, timelines),
            [MotionBlockStore(performer.track) for performer in motion.performers],
        )
        for performer, block_store in zip(motion.performers, blocks, strict=True):
            for index, packet in enumerate(performer.packets[-1]):
                block_store.put(index, 0, decode_motion_block(performer.track, Data.unpack(packet).block))
        for frame in range(0, 400, 3):
            await poses.decode_blocks(frame * STEP_US)
            found = poses.poses_at(frame * STEP_US, STEP_US)
            assert found is not None
            position = frame * STEP_US % motion.first_track.duration_us
            for pose, block_store, performer in zip(found, blocks, motion.performers, strict=True):
                expected = block_store.pose_at(position, True, motion.first_track.duration_us)
                assert expected is not None
                for values, placed in zip(pose, performer.placement.apply(*expected), strict=True):
                    np.testing.assert_allclose(values, placed, atol=1e-12)
            # after the end of its track a performer keeps the last pose
            if name == "both" and position > MOTIONS[other].first_track.duration_us:
                last = blocks[1].pose_at(MOTIONS[other].first_track.duration_us, False)
                assert last is not None
                np.testing.assert_allclose(found[1][1][1:], last[1][1:], atol=1e-12)
    assert track.duration_us == MOTIONS["one"].first_track.duration_us
