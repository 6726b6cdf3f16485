"""The dances as a stage needs them: their rotations at clock times a little ahead, from their best blocks."""

from __future__ import annotations

import asyncio
import secrets
from weakref import WeakValueDictionary

from bunraku.codec.container import StoredMotion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MotionTrack
from bunraku.motion.rotation import Array
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore
from bunraku.playout.timeline import TimelineHistory
from bunraku.wire.messages import Data

BATCH_FRAMES = 60
"""Frames that are worked out at once: many cost little more than one."""

_block_stores: WeakValueDictionary[int, MotionBlockStore] = WeakValueDictionary()


def shared_block_store(track: MotionTrack) -> MotionBlockStore:
    """The decoded blocks of a dance: one store for all stages that dance it, as long as any does."""
    # a store holds its track, so that no other has this number meanwhile
    store = _block_stores.get(id(track))
    if store is None:
        store = _block_stores[id(track)] = MotionBlockStore(track)
    return store


class PoseCache:
    """The dances of the performers of one stage."""

    def __init__(self, motion: StoredMotion, timelines: TimelineHistory) -> None:
        self._motion = motion
        self._timelines = timelines
        self._blocks = [shared_block_store(dance.track) for dance in motion.performers]
        self._poses_by_time: dict[int, tuple[Array, ...]] = {}
        self._epoch = -1
        self._batch_phase = secrets.randbelow(BATCH_FRAMES)

    async def decode_blocks(self, due: int) -> None:
        """Decode what is needed about clock time `due`, in a thread: it takes milliseconds, the first time seconds."""
        newest = self._timelines.newest
        if newest is None or newest.motion != self._motion.id:
            return
        position = timeline.position_at(newest, due)
        for dance, blocks in zip(self._motion.performers, self._blocks, strict=True):
            track = dance.track
            first = track.block_at(position)
            # whoever dances longer than the motion lasts goes on with the first block after another one
            for index in (first, (first + 1) % track.block_count, 0):
                if blocks.level(index) < 0:
                    packet = Data.unpack(dance.packets[-1][index])
                    blocks.put(index, packet.rate, await asyncio.to_thread(decode_motion_block, track, packet.block))

    def poses_at(self, due: int, step_us: int) -> tuple[Array, ...] | None:
        """The rotations (18, 4) of each performer at clock time `due`, None where a block is missing or another motion
        is on.

        Those of the next frames, `step` µs apart, at most `AHEAD`, are worked out with it, and hold until the timeline
        is edited. Stages do so at instants of their own: fifty at once would keep all from working for a tenth of a
        second.
        """
        newest = self._timelines.newest
        if newest is None:
            return None
        if newest.epoch != self._epoch or due not in self._poses_by_time:
            self._epoch = newest.epoch
            frames = BATCH_FRAMES - (due // step_us + self._batch_phase) % BATCH_FRAMES
            self._poses_by_time = self._compute_poses([due + step_us * k for k in range(frames)])
        return self._poses_by_time.get(due)

    def _compute_poses(self, due_times: list[int]) -> dict[int, tuple[Array, ...]]:
        states = [self._timelines.at(due) for due in due_times]
        here = [
            (due, timeline.position_at(state, due), state.loop)
            for due, state in zip(due_times, states, strict=True)
            if state is not None and state.motion == self._motion.id
        ]
        if not here:
            return {}
        positions, loop = [position for _, position, _ in here], here[0][2]
        duration = self._motion.first_track.duration_us
        each = (blocks.rotations_at(positions, loop, duration) for blocks in self._blocks)
        known: dict[int, tuple[Array, ...]] = {}
        for (due, _, _), poses in zip(here, zip(*each, strict=True), strict=True):
            whole = tuple(pose for pose in poses if pose is not None)
            if len(whole) == len(poses):
                known[due] = whole
        return known
