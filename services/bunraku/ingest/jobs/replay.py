"""Replay of a session: the poses that viewers saw at any clock time, of live performers and with controlled limbs."""

from __future__ import annotations

import contextlib
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence

from bunraku.codec.container import PerformerTracks, StoredMotion
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.props import PropTrack, ShownState, shift_limb
from bunraku.codec.extension.track import ExtensionTrack, decode_extension_block
from bunraku.codec.live import LiveTrack
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.motion.rotation import Array
from bunraku.playout.block_store import ExtensionBlockStore, MotionBlockStore, Pose, PropBlockStore
from bunraku.playout.live_buffer import LiveBuffer
from bunraku.playout.overlay_buffer import OVERLAY_HOLD_US, OverlayBuffer
from bunraku.playout.session_log import SessionLog
from bunraku.playout.timeline import position_at
from bunraku.wire.live import Live
from bunraku.wire.messages import Data, TimelineState
from bunraku.wire.overlay import Overlay
from bunraku.wire.prop import Prop

OVERLAY_LEAD_US = 100_000
"""Lead time with which overlays are published before they are due, in microseconds: no viewer gets them earlier."""


class MissingMotion(ValueError):
    """A motion that a session played and that has been removed."""


class SessionReplay:
    """Stage of one session, from its log and the motions that it played, by id."""

    def __init__(self, log: SessionLog, motions: Mapping[str, StoredMotion]) -> None:
        self._log = log
        self._states = sorted(log.timelines, key=lambda state: state.epoch)
        self._clocks = [state.clock for state in self._states]
        self._performers_by_motion = {
            motion: [_PerformerPlayback(performer) for performer in stored.performers]
            for motion, stored in motions.items()
        }

    def timeline_at(self, clock: int) -> TimelineState | None:
        """Return the timeline at a clock time, None before the first."""
        index = bisect_right(self._clocks, clock)
        return self._states[index - 1] if index else None

    def session_props_at(self, clock: int) -> dict[int, Prop]:
        """Return the props of the session at a clock time, by number."""
        return self._log.props_at(clock)

    def motion_poses_at(self, clock: int) -> list[Pose] | None:
        """Return each performer's live pose, or else its pose in the stored motion.

        Return None before the first timeline; raise `MissingMotion`.
        """
        state = self.timeline_at(clock)
        if state is None:
            return None
        position = position_at(state, clock)
        poses = (
            performer.live.pose_at(clock) or performer.pose_at(position, state.loop, state.duration)
            for performer in self._performers_of(state.motion)
        )
        # never None, as every block is stored
        return [pose for pose in poses if pose is not None]

    def replay_poses(self, times: Iterable[int]) -> Iterator[list[Pose] | None]:
        """Yield each performer's pose with overlays at ascending clock `times`, None before the first timeline.

        Raise `MissingMotion`, and `CorruptSessionLog` for a message that cannot be read.
        """
        overlays, logged, upcoming = OverlayBuffer(), None, None
        for clock in times:
            if logged is None:
                logged = self._log.messages(clock - OVERLAY_HOLD_US)
                upcoming = next(logged, None)
            while upcoming is not None and upcoming.due <= clock + OVERLAY_LEAD_US:
                if isinstance(upcoming, Overlay):
                    overlays.put(upcoming)
                else:
                    self._put_live(upcoming)
                upcoming = next(logged, None)
            poses = self.motion_poses_at(clock)
            yield (
                None
                if poses is None
                else [(root, overlays.apply(rotations, clock, index)) for index, (root, rotations) in enumerate(poses)]
            )

    def _put_live(self, message: Live) -> None:
        """Add live poses to the performers of the motion that is played when they are due."""
        state = self.timeline_at(message.due)
        performers = self._performers_by_motion.get(state.motion, []) if state is not None else []
        for number, block in message.blocks.items():
            # around a change of the motion, a message may show a performer of the other one
            if number < len(performers):
                with contextlib.suppress(DamagedBlock):
                    performers[number].live.put(message.due, message.frames, block.data)

    def _performers_of(self, motion: str) -> list[_PerformerPlayback]:
        if motion not in self._performers_by_motion:
            raise MissingMotion(f"the motion {motion} was removed from the library")
        return self._performers_by_motion[motion]


class ExtensionPlayback:
    """Extension of a performer at the highest bitrate level, decoded on demand."""

    def __init__(self, track: ExtensionTrack, packets: Sequence[bytes]) -> None:
        self.track, self._packets = track, packets
        self._store = ExtensionBlockStore(track)

    def values_at(self, state: TimelineState, clock: int) -> Array:
        """Return the values (E, 3) that a timeline shows at a clock time."""
        position = position_at(state, clock)
        index = self.track.block_at(position)
        for needed in (index, (index + 1) % self.track.block_count):
            if self._store.level(needed) < 0:
                packet = Data.unpack(self._packets[needed])
                self._store.put(needed, packet.rate, decode_extension_block(self.track, packet.block))
        values = self._store.values_at(position, state.loop, state.duration)
        assert values is not None, "every block is stored"
        return values


def extensions_of(motion: StoredMotion) -> list[ExtensionPlayback]:
    """Return the extensions of a motion's performers."""
    return [
        ExtensionPlayback(track, packets[-1])
        for track, packets in zip(motion.tracks, motion.packets, strict=True)
        if isinstance(track, ExtensionTrack)
    ]


class PropPlayback:
    """Props of a motion, decoded on demand. Limbs are those of the stage."""

    def __init__(self, track: PropTrack, packets: Sequence[bytes]) -> None:
        self.track, self._packets = track, packets
        self._store = PropBlockStore(track)

    def states_at(self, state: TimelineState, clock: int) -> list[ShownState]:
        """Return the state of each prop that a timeline shows at a clock time."""
        position = position_at(state, clock)
        index = self.track.block_at(position)
        if self._store.level(index) < 0:
            packet = Data.unpack(self._packets[index])
            self._store.put_encoded(index, packet.rate, packet.block)
        states = self._store.states_at(position)
        assert states is not None, "every block is stored"
        return [shift_limb(shown, self.track.performer) for shown in states]


def props_of(motion: StoredMotion) -> list[PropPlayback]:
    """Return the tracks of props of a motion."""
    return [
        PropPlayback(track, packets[-1])
        for track, packets in zip(motion.tracks, motion.packets, strict=True)
        if isinstance(track, PropTrack)
    ]


class _PerformerPlayback:
    """A performer's motion at the highest bitrate level, decoded on demand."""

    def __init__(self, performer: PerformerTracks) -> None:
        self.track, self._packets = performer.track, performer.packets[-1]
        self._store = MotionBlockStore(performer.track)
        self.live = LiveBuffer(LiveTrack(performer.track.skeleton))

    def pose_at(self, position: int, loop: bool, duration: int) -> Pose | None:
        index = self.track.block_at(position)
        for needed in (index, (index + 1) % self.track.block_count):
            if self._store.level(needed) < 0:
                packet = Data.unpack(self._packets[needed])
                self._store.put(needed, packet.rate, decode_motion_block(self.track, packet.block))
        return self._store.pose_at(position, loop, duration)
