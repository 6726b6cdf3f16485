"""What a session's stage showed at any clock time: the dances, and what was pulled laid over them as viewers saw it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping

from bunraku.backing.library import Dance, StoredMotion
from bunraku.codec.decode import decode_block
from bunraku.marionette.log import Log
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.playout.blocks import BlockStore, Pose
from bunraku.playout.overlays import LASTS, Overlays, pack_joints
from bunraku.playout.timeline import position_at
from bunraku.wire.messages import Data, TimelineState
from bunraku.wire.overlay import Overlay

AHEAD = 100_000
"""Overlays are made so long before they are due, microseconds: no viewer knows of one sooner."""


class MissingDance(ValueError):
    """A dance that a session was over and that is no longer in the library."""


class Showing:
    """The stage of one session, by its log and the dances it was over, by id."""

    def __init__(self, log: Log, dances: Mapping[str, StoredMotion]) -> None:
        self._log = log
        self._states = sorted(log.timelines, key=lambda state: state.epoch)
        self._clocks = [state.clock for state in self._states]
        self._dances = {motion: [_Dance(dance) for dance in stored.dances] for motion, stored in dances.items()}

    def timeline_at(self, clock: int) -> TimelineState | None:
        """The timeline that held at a clock time, None before there was one."""
        index = bisect_right(self._clocks, clock)
        return self._states[index - 1] if index else None

    def dances_at(self, clock: int) -> list[Pose] | None:
        """The pose of each performer's dance at a clock time, None where there was none; raises `MissingDance`."""
        state = self.timeline_at(clock)
        if state is None:
            return None
        position = position_at(state, clock)
        # every block is there
        poses = (dance.pose_at(position, state.loop, state.duration) for dance in self._performers(state.motion))
        return [pose for pose in poses if pose is not None]

    def poses(self, times: Iterable[int]) -> Iterator[list[Pose] | None]:
        """What was seen of each performer at clock `times`, ascending: None where there was no dance. Raises
        `MissingDance`, and `DamagedLog` where the log cannot be replayed."""
        overlays, following, sequence = Overlays(), None, 0
        replayed = None
        for clock in times:
            if replayed is None:
                replayed = self._log.replay(self._figures, self._rotations_at, clock - LASTS)
                following = next(replayed, None)
            while following is not None and following[0] <= clock + AHEAD:
                due, laid = following
                overlays.put(Overlay(sequence, due, {limb: pack_joints(joints) for limb, joints in laid.items()}))
                sequence = (sequence + 1) & 0xFFFF
                following = next(replayed, None)
            poses = self.dances_at(clock)
            yield (
                None
                if poses is None
                else [(root, overlays.lay(rotations, clock, nth)) for nth, (root, rotations) in enumerate(poses)]
            )

    def _performers(self, motion: str) -> list[_Dance]:
        if motion not in self._dances:
            raise MissingDance(f"the dance {motion} was removed from the library")
        return self._dances[motion]

    def _figures(self, motion: str) -> list[Figure]:
        return [dance.track.figure for dance in self._performers(motion)]

    def _rotations_at(self, clock: int) -> list[Array] | None:
        poses = self.dances_at(clock)
        return None if poses is None else [rotations for _, rotations in poses]


class _Dance:
    """A dance at its best rate, decoded where it is shown."""

    def __init__(self, dance: Dance) -> None:
        self.track, self._packets = dance.track, dance.packets[-1]
        self._store = BlockStore(dance.track)

    def pose_at(self, position: int, loop: bool, duration: int) -> Pose | None:
        index = self.track.block_at(position)
        for needed in (index, (index + 1) % self.track.blocks):
            if self._store.rate(needed) < 0:
                packet = Data.unpack(self._packets[needed])
                self._store.put(needed, packet.rate, decode_block(self.track, packet.block))
        return self._store.pose_at(position, loop, duration)
