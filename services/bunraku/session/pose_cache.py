"""Poses of the performers of a stage at clock times a little ahead, from the best blocks."""

from __future__ import annotations

import asyncio
import secrets
from weakref import WeakValueDictionary

from bunraku.codec.container import StoredMotion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MotionTrack
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.playout.timeline import TimelineHistory
from bunraku.wire.messages import Data

BATCH_FRAMES = 60
"""Frames computed in one batch, which costs little more than one frame."""

_block_stores: WeakValueDictionary[int, MotionBlockStore] = WeakValueDictionary()


def shared_block_store(track: MotionTrack) -> MotionBlockStore:
    """Return the decoded blocks of a track, shared by all stages that play it."""
    # the store holds the track, so no other track has this id meanwhile
    store = _block_stores.get(id(track))
    if store is None:
        store = _block_stores[id(track)] = MotionBlockStore(track)
    return store


class PoseCache:
    """Poses of the performers of one stage."""

    def __init__(self, motion: StoredMotion, timelines: TimelineHistory) -> None:
        self._motion = motion
        self._timelines = timelines
        self._blocks = [shared_block_store(performer.track) for performer in motion.performers]
        self._poses_by_time: dict[int, tuple[Pose, ...]] = {}
        self._epoch = -1
        self._batch_phase = secrets.randbelow(BATCH_FRAMES)

    async def decode_blocks(self, due: int) -> None:
        """Decode the blocks needed around clock time `due` in a thread; takes milliseconds, the first time seconds."""
        newest = self._timelines.newest
        if newest is None or newest.motion != self._motion.id:
            return
        position = timeline.position_at(newest, due)
        for performer, blocks in zip(self._motion.performers, self._blocks, strict=True):
            track = performer.track
            first = track.block_at(position)
            # a track that is longer than the motion continues with the first block after another one
            for index in (first, (first + 1) % track.block_count, 0):
                if blocks.level(index) < 0:
                    packet = Data.unpack(performer.packets[-1][index])
                    blocks.put(index, packet.rate, await asyncio.to_thread(decode_motion_block, track, packet.block))

    def poses_at(self, due: int, step_us: int) -> tuple[Pose, ...] | None:
        """Return the pose of each performer, placed on the stage, at clock time `due`.

        None if a block is missing or another motion plays. Poses of up to `BATCH_FRAMES` next frames, `step_us` apart,
        are computed at the same time; they are valid until the timeline is edited. Each stage has its own phase of
        these batches: fifty at once would block the event loop for a tenth of a second.
        """
        newest = self._timelines.newest
        if newest is None:
            return None
        if newest.epoch != self._epoch or due not in self._poses_by_time:
            self._epoch = newest.epoch
            frames = BATCH_FRAMES - (due // step_us + self._batch_phase) % BATCH_FRAMES
            self._poses_by_time = self._compute_poses([due + step_us * k for k in range(frames)])
        return self._poses_by_time.get(due)

    def _compute_poses(self, due_times: list[int]) -> dict[int, tuple[Pose, ...]]:
        states = [self._timelines.at(due) for due in due_times]
        playing = [
            (due, timeline.position_at(state, due), state.loop)
            for due, state in zip(due_times, states, strict=True)
            if state is not None and state.motion == self._motion.id
        ]
        if not playing:
            return {}
        positions, loop = [position for _, position, _ in playing], playing[0][2]
        duration = self._motion.first_track.duration_us
        each = (blocks.poses_at(positions, loop, duration) for blocks in self._blocks)
        placements = [performer.placement for performer in self._motion.performers]
        computed: dict[int, tuple[Pose, ...]] = {}
        for (due, _, _), poses in zip(playing, zip(*each, strict=True), strict=True):
            placed = tuple(
                placement.apply(*pose) for placement, pose in zip(placements, poses, strict=True) if pose is not None
            )
            if len(placed) == len(poses):
                computed[due] = placed
        return computed
