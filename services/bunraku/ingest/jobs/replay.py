"""What a session's stage showed at any clock time: the dances, and what was pulled laid over them as viewers saw it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping

from bunraku.codec.container import PerformerTracks, StoredMotion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.marionette.input_log import InputLog
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.playout.overlay_buffer import OVERLAY_HOLD_US, OverlayBuffer, pack_joints
from bunraku.playout.timeline import position_at
from bunraku.wire.messages import Data, TimelineState
from bunraku.wire.overlay import Overlay

OVERLAY_LEAD_US = 100_000
"""Overlays are made so long before they are due, microseconds: no viewer knows of one sooner."""


class MissingMotion(ValueError):
    """A dance that a session was over and that is no longer in the library."""


class SessionReplay:
    """The stage of one session, by its log and the dances it was over, by id."""

    def __init__(self, log: InputLog, motions: Mapping[str, StoredMotion]) -> None:
        self._log = log
        self._states = sorted(log.timelines, key=lambda state: state.epoch)
        self._clocks = [state.clock for state in self._states]
        self._performers_by_motion = {
            motion: [_PerformerPlayback(dance) for dance in stored.performers] for motion, stored in motions.items()
        }

    def timeline_at(self, clock: int) -> TimelineState | None:
        """The timeline that held at a clock time, None before there was one."""
        index = bisect_right(self._clocks, clock)
        return self._states[index - 1] if index else None

    def motion_poses_at(self, clock: int) -> list[Pose] | None:
        """The pose of each performer's dance at a clock time, None where there was none; raises `MissingDance`."""
        state = self.timeline_at(clock)
        if state is None:
            return None
        position = position_at(state, clock)
        # every block is there
        poses = (dance.pose_at(position, state.loop, state.duration) for dance in self._performers_of(state.motion))
        return [pose for pose in poses if pose is not None]

    def replay_poses(self, times: Iterable[int]) -> Iterator[list[Pose] | None]:
        """What was seen of each performer at clock `times`, ascending: None where there was no dance. Raises
        `MissingDance`, and `DamagedLog` where the log cannot be replayed."""
        overlays, following, sequence = OverlayBuffer(), None, 0
        replayed = None
        for clock in times:
            if replayed is None:
                replayed = self._log.replay(self._figures_of, self._rotations_at, clock - OVERLAY_HOLD_US)
                following = next(replayed, None)
            while following is not None and following[0] <= clock + OVERLAY_LEAD_US:
                due, laid = following
                overlays.put(Overlay(sequence, due, {limb: pack_joints(joints) for limb, joints in laid.items()}))
                sequence = (sequence + 1) & 0xFFFF
                following = next(replayed, None)
            poses = self.motion_poses_at(clock)
            yield (
                None
                if poses is None
                else [(root, overlays.apply(rotations, clock, nth)) for nth, (root, rotations) in enumerate(poses)]
            )

    def _performers_of(self, motion: str) -> list[_PerformerPlayback]:
        if motion not in self._performers_by_motion:
            raise MissingMotion(f"the dance {motion} was removed from the library")
        return self._performers_by_motion[motion]

    def _figures_of(self, motion: str) -> list[Figure]:
        return [dance.track.figure for dance in self._performers_of(motion)]

    def _rotations_at(self, clock: int) -> list[Array] | None:
        poses = self.motion_poses_at(clock)
        return None if poses is None else [rotations for _, rotations in poses]


class _PerformerPlayback:
    """A dance at its best rate, decoded where it is shown."""

    def __init__(self, performer: PerformerTracks) -> None:
        self.track, self._packets = performer.track, performer.packets[-1]
        self._store = MotionBlockStore(performer.track)

    def pose_at(self, position: int, loop: bool, duration: int) -> Pose | None:
        index = self.track.block_at(position)
        for needed in (index, (index + 1) % self.track.block_count):
            if self._store.level(needed) < 0:
                packet = Data.unpack(self._packets[needed])
                self._store.put(needed, packet.rate, decode_motion_block(self.track, packet.block))
        return self._store.pose_at(position, loop, duration)
