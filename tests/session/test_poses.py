from __future__ import annotations

import gc
from collections import Counter

import numpy as np
import pytest

from bunraku.backing.library import Library, StoredMotion, pack
from bunraku.codec.decode import MotionBlock, decode_block
from bunraku.codec.encode import encode_motion
from bunraku.codec.track import MotionTrack
from bunraku.motion.rotation import Array
from bunraku.playout import timeline
from bunraku.playout.blocks import BlockStore
from bunraku.playout.timeline import Timelines
from bunraku.session import poses as poses_module
from bunraku.session.poses import AHEAD, Poses, blocks_of
from bunraku.wire.messages import Data
from tests.ingest.dances import DANCES
from tests.vectors.blocks import wandering_motion

STEP = 16_667


async def stored() -> StoredMotion:
    library = Library.open("memory:///")
    await library.put("one", pack("one", encode_motion(wandering_motion(2.3, 30.0, 5), ladder=(5.0,), grade="live")))
    motion = await library.get("one")
    assert motion is not None
    return motion


async def test_the_dance_ahead_is_the_dance_at_each_instant_also_over_the_ends_of_blocks_and_the_loop() -> None:
    motion = await stored()
    track = motion.track
    timelines = Timelines()
    timelines.put(timeline.start("one", track.duration_us, 1_000_000))
    poses, blocks = Poses(motion, timelines), BlockStore(track)
    for index, packet in enumerate(motion.dance[-1]):
        blocks.put(index, 0, decode_block(track, Data.unpack(packet).block))
    for frame in range(200):
        due = 1_000_000 + frame * STEP
        await poses.prepare(due)
        wanted = blocks.pose_at(due - 1_000_000 - (due - 1_000_000) // track.duration_us * track.duration_us)
        found = poses.at(due, STEP)
        assert wanted is not None
        assert found is not None
        np.testing.assert_allclose(found[0], wanted[1], atol=1e-12)


async def test_an_edit_holds_at_once_and_another_motion_has_no_pose_here() -> None:
    motion = await stored()
    timelines = Timelines()
    first = timeline.start("one", motion.track.duration_us, 0)
    timelines.put(first)
    poses = Poses(motion, timelines)
    assert poses.at(500_000, STEP) is None
    await poses.prepare(500_000)
    moving = poses.at(500_000, STEP)
    paused = timeline.edit(first, 500_000, position=200_000, playing=False)
    timelines.put(paused)
    await poses.prepare(500_000)
    still = poses.at(500_000, STEP)
    assert moving is not None
    assert still is not None
    assert np.abs(moving[0] - still[0]).max() > 1e-3
    later = poses.at(500_000 + 40 * STEP, STEP)
    assert later is not None
    np.testing.assert_array_equal(later, still)
    timelines.put(timeline.change(paused, 600_000, "two", 5_000_000))
    await poses.prepare(700_000)
    assert poses.at(700_000, STEP) is None


async def test_stages_work_out_the_dance_at_instants_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = await stored()
    timelines = Timelines()
    timelines.put(timeline.start("one", motion.track.duration_us, 0))
    stages = [Poses(motion, timelines) for _ in range(50)]
    for poses in stages:
        for due in (0, 1_000_000):
            await poses.prepare(due)
    worked_out: list[int] = []
    rotations_at = BlockStore.rotations_at

    def counted(store: BlockStore, positions: list[int], loop: bool, duration: int) -> list[Array | None]:
        worked_out.append(frame)
        return rotations_at(store, positions, loop, duration)

    monkeypatch.setattr(BlockStore, "rotations_at", counted)
    for frame in range(2 * AHEAD):
        for poses in stages:
            assert poses.at(frame * STEP, STEP) is not None
    # the first frame is new to all of them
    later = Counter(worked_out[len(stages) :])
    assert sum(later.values()) >= len(stages)
    assert max(later.values()) <= 10


async def test_a_dance_is_decoded_once_for_all_stages_and_forgotten_with_the_last(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    motion, decoded = await stored(), 0

    def counted(track: MotionTrack, data: bytes) -> MotionBlock:
        nonlocal decoded
        decoded += 1
        return decode_block(track, data)

    monkeypatch.setattr(poses_module, "decode_block", counted)
    timelines = Timelines()
    timelines.put(timeline.start("one", motion.track.duration_us, 0))
    stages = [Poses(motion, timelines) for _ in range(5)]
    for poses in stages:
        for due in (0, 1_000_000):
            await poses.prepare(due)
            assert poses.at(due, STEP) is not None
    assert decoded == motion.track.blocks
    other = await stored()
    assert blocks_of(other.track) is not blocks_of(motion.track)
    del stages, poses
    gc.collect()
    assert blocks_of(motion.track).rate(0) == -1


async def test_all_who_perform_have_poses_also_where_one_dances_longer_or_shorter_than_the_motion() -> None:
    track = DANCES["both"].track
    for name, other in (("both", "two"), ("longer", "one")):
        motion = DANCES[name]
        timelines = Timelines()
        timelines.put(timeline.start(motion.id, motion.track.duration_us, 0))
        poses, blocks = Poses(motion, timelines), [BlockStore(dance.track) for dance in motion.dances]
        for dance, store in zip(motion.dances, blocks, strict=True):
            for index, packet in enumerate(dance.packets[-1]):
                store.put(index, 0, decode_block(dance.track, Data.unpack(packet).block))
        for frame in range(0, 400, 3):
            await poses.prepare(frame * STEP)
            found = poses.at(frame * STEP, STEP)
            assert found is not None
            position = frame * STEP % motion.track.duration_us
            for rotations, store in zip(found, blocks, strict=True):
                wanted = store.pose_at(position, True, motion.track.duration_us)
                assert wanted is not None
                np.testing.assert_allclose(rotations, wanted[1], atol=1e-12)
            # of one that is over the last pose stands still
            if name == "both" and position > DANCES[other].track.duration_us:
                last = blocks[1].pose_at(DANCES[other].track.duration_us, False)
                assert last is not None
                np.testing.assert_allclose(found[1], last[1], atol=1e-12)
    assert track.duration_us == DANCES["one"].track.duration_us
