"""Blocks that a viewer holds, and their values at any position (proto/codec.md, 2.8 and 2.14)."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

import numpy as np

from bunraku.codec.extension.contact import ContactBlock, ContactTrack, decode_contact_block
from bunraku.codec.extension.props import PropBlock, PropTrack, ShownState, decode_prop_block
from bunraku.codec.extension.track import ExtensionBlock, ExtensionTrack
from bunraku.codec.motion_decoder import MotionBlock
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import SceneBlock
from bunraku.codec.timing import Timing
from bunraku.motion import rotation
from bunraku.motion.contact.foot_contact import BoolArray
from bunraku.motion.rotation import Array

Pose = tuple[Array, Array]
"""Root position (3,) in metres and joint rotations (18, 4), each in its parent's frame."""


class _Block(Protocol):
    @property
    def frames(self) -> int:
        """Frames of the block."""


Block = TypeVar("Block", bound=_Block)
Track = TypeVar("Track", bound=Timing)


class TrackBlockStore(Generic[Track, Block]):
    """Decoded blocks of one track, each at the highest level received."""

    def __init__(self, track: Track) -> None:
        self.track = track
        self._blocks: dict[int, tuple[int, Block]] = {}

    def put(self, index: int, level: int, block: Block) -> bool:
        """Store a block unless one of a higher level is stored; return True if it was stored.

        Raises ValueError if the block does not fit the track.
        """
        if not 0 <= index < self.track.block_count or block.frames != self.track.frames_in(index):
            raise ValueError(f"Block {index} with {block.frames} frames does not belong to this track")
        if index in self._blocks and self._blocks[index][0] > level:
            return False
        self._blocks[index] = (level, block)
        return True

    def level(self, index: int) -> int:
        """Return the level of the stored block, -1 if it is missing."""
        return self._blocks[index][0] if index in self._blocks else -1

    def buffered_us(self, position: int, loop: bool) -> int:
        """Return the duration stored from `position` on without a gap, at most one loop; microseconds."""
        track, end = self.track, position
        first = track.block_at(position)
        for index in range(first, first + track.block_count if loop else track.block_count):
            turn, block = divmod(index, track.block_count)
            if block not in self._blocks:
                break
            end = turn * track.duration_us + min(track.start_us(block + 1), track.duration_us)
        return max(end - position, 0)

    def _find_block(
        self, position: int, loop: bool, duration: int | None = None
    ) -> tuple[Block, float, Block | None] | None:
        """Return the block at motion time `position`, the instant in it in frames, and the following block.

        The following block is returned past the last frame only, if it is stored. At the end of a loop it is the first
        one, if the track is as long as the motion (`duration` microseconds, by default that of the track). Returns None
        if the block is missing.
        """
        track = self.track
        loop = loop and (duration is None or track.duration_us + 1e6 / track.fps > duration)
        index = track.block_at(position)
        if index not in self._blocks:
            return None
        block = self._blocks[index][1]
        instant = position * track.fps / 1e6 - track.first_frame(index)
        following = index + 1 if index + 1 < track.block_count else 0 if loop else -1
        if instant <= block.frames - 1 or following not in self._blocks:
            return block, min(max(instant, -0.5), block.frames - 0.5), None
        return block, instant, self._blocks[following][1]

    def _find_frame(self, position: int) -> tuple[Block, int] | None:
        """Return the block at motion time `position`, and the frame in it that began last; None if it is missing."""
        index = self.track.block_at(position)
        if index not in self._blocks:
            return None
        block = self._blocks[index][1]
        frame = int((position + 1) * self.track.fps / 1e6) - self.track.first_frame(index)
        return block, min(max(frame, 0), block.frames - 1)


class MotionBlockStore(TrackBlockStore[MotionTrack, MotionBlock]):
    """Decoded blocks of one performer's motion, each at the highest level received."""

    def pose_at(self, position: int, loop: bool = True, duration: int | None = None) -> Pose | None:
        """Return the pose at motion time `position` (microseconds), None if its block is missing.

        Between the last frame of a block and the first of the next, the two are interpolated if the next is stored.
        This holds at the end of a loop, too, if the track is as long as the motion (`duration` microseconds, by default
        that of the track). Past the end of a shorter track the pose stays constant.
        """
        found = self._find_block(position, loop, duration)
        if found is None:
            return None
        block, instant, following = found
        if following is None:
            root, rotations = block.pose_at(instant)
            return root[0], rotations[0]
        (root, rotations), (next_root, next_rotations) = block.pose_at(block.frames - 1.0), following.pose_at(0.0)
        mix = min(instant - (block.frames - 1), 1.0)
        return (
            root[0] + mix * (next_root[0] - root[0]),
            rotation.slerp(rotations[0], next_rotations[0], np.full(len(rotations[0]), mix)),
        )

    def poses_at(self, positions: list[int], loop: bool = True, duration: int | None = None) -> list[Pose | None]:
        """Return the poses of `pose_at` at several motion times, for little more than the cost of one."""
        found: list[Pose | None] = [None] * len(positions)
        groups: dict[tuple[int, bool], tuple[MotionBlock, MotionBlock | None, list[int], list[float]]] = {}
        for nth, position in enumerate(positions):
            location = self._find_block(position, loop, duration)
            if location is None:
                continue
            block, instant, following = location
            members = groups.setdefault((id(block), following is None), (block, following, [], []))
            members[2].append(nth)
            members[3].append(instant)
        for block, following, numbers, instants in groups.values():
            roots, rotations = _interpolate_poses(block, following, np.array(instants))
            for nth, root, pose in zip(numbers, roots, rotations, strict=True):
                found[nth] = root, pose
        return found


def _interpolate_poses(block: MotionBlock, following: MotionBlock | None, instants: Array) -> tuple[Array, Array]:
    """Return roots (m, 3) and rotations (m, 18, 4) at `instants` (m,) of a block, or between it and the following."""
    if following is None:
        roots, rotations = block.pose_at(instants)
        return roots, rotations
    (last_root, last), (first_root, first) = block.pose_at(block.frames - 1.0), following.pose_at(0.0)
    mix = np.minimum(instants - (block.frames - 1), 1.0)
    return (
        last_root[0] + mix[:, None] * (first_root[0] - last_root[0]),
        rotation.slerp(last[0], first[0], np.repeat(mix[:, None], len(last[0]), axis=1)),
    )


class _ValuesBlock(_Block, Protocol):
    def values_at(self, instants: Array | float) -> Array:
        """Return the values (m, ...) at `instants` (m,), in frames from the block's first."""


ValuesBlock = TypeVar("ValuesBlock", bound=_ValuesBlock)


class ValuesBlockStore(TrackBlockStore[Track, ValuesBlock]):
    """Decoded blocks of a track of values that are interpolated linearly, each at the highest level received."""

    def values_at(self, position: int, loop: bool, duration: int) -> Array | None:
        """Return the values at `position` of a motion of `duration` microseconds, None if the block is missing.

        They are interpolated between blocks, and at the end of a loop if the track is as long as the motion. Past the
        end of a shorter track they stay constant.
        """
        found = self._find_block(position, loop, duration)
        if found is None:
            return None
        block, instant, following = found
        if following is None:
            values: Array = block.values_at(instant)[0]
            return values
        last, first = block.values_at(block.frames - 1.0)[0], following.values_at(0.0)[0]
        mixed: Array = last + min(instant - (block.frames - 1), 1.0) * (first - last)
        return mixed


class SceneBlockStore(ValuesBlockStore[SceneTrack, SceneBlock]):
    """Decoded blocks of one camera or light: seven values."""


class ExtensionBlockStore(ValuesBlockStore[ExtensionTrack, ExtensionBlock]):
    """Decoded blocks of one extension: values (E, 3) of its channels."""


class ContactBlockStore(TrackBlockStore[ContactTrack, ContactBlock]):
    """Decoded blocks of the contacts of one performer."""

    def put_encoded(self, index: int, level: int, data: bytes) -> bool:
        """Decode and store a block; return True if it was stored. Raises ValueError or `DamagedBlock`."""
        if not 0 <= index < self.track.block_count:
            raise ValueError(f"Block {index} does not belong to this track of {self.track.block_count} blocks")
        return self.put(index, level, decode_contact_block(data, self.track.frames_in(index)))

    def contacts_at(self, position: int) -> BoolArray | None:
        """Return whether the left and the right foot are planted (2,) at motion time `position`, in microseconds.

        A frame lasts until the next one. Returns None if the block is missing.
        """
        found = self._find_frame(position)
        if found is None:
            return None
        block, frame = found
        planted: BoolArray = block.planted[frame]
        return planted


class PropBlockStore(TrackBlockStore[PropTrack, PropBlock]):
    """Decoded blocks of the props of a motion."""

    def put_encoded(self, index: int, level: int, data: bytes) -> bool:
        """Decode and store a block; return True if it was stored. Raises ValueError or `DamagedBlock`."""
        if not 0 <= index < self.track.block_count:
            raise ValueError(f"Block {index} does not belong to this track of {self.track.block_count} blocks")
        return self.put(index, level, decode_prop_block(data, len(self.track.kinds), self.track.frames_in(index)))

    def states_at(self, position: int) -> tuple[ShownState, ...] | None:
        """Return the state of each prop at motion time `position`, in microseconds; limbs are those of the track.

        A frame lasts until the next one. Returns None if the block is missing.
        """
        found = self._find_frame(position)
        return None if found is None else tuple(states[found[1]] for states in found[0].states)
