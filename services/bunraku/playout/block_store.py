"""The blocks a viewer holds, and what they show at any instant (SPEC.md, Motion block and Scene block)."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

import numpy as np

from bunraku.codec.motion_decoder import MotionBlock
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import SceneBlock
from bunraku.codec.timing import Timing
from bunraku.motion import rotation
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
    """Decoded blocks of one track, of each the best rate that came."""

    def __init__(self, track: Track) -> None:
        self.track = track
        self._blocks: dict[int, tuple[int, Block]] = {}

    def put(self, index: int, level: int, block: Block) -> bool:
        """Keep a block unless a better one is here; whether it was kept. One that does not fit the track is refused
        with ValueError."""
        if not 0 <= index < self.track.block_count or block.frames != self.track.frames_in(index):
            raise ValueError(f"block {index} with {block.frames} frames is not of this motion")
        if index in self._blocks and self._blocks[index][0] > level:
            return False
        self._blocks[index] = (level, block)
        return True

    def level(self, index: int) -> int:
        """The rate held of a block, -1 where it is missing."""
        return self._blocks[index][0] if index in self._blocks else -1

    def buffered_us(self, position: int, loop: bool) -> int:
        """Microseconds of motion that are here from `position` on without a gap, once around at most."""
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
        """The block at motion time `position` and the instant in it, in frames from its first; past its last frame
        also the block that follows, where that is here: at the end of a loop where the track is as long as the motion,
        whose `duration` in microseconds is its own where that is not given. None where the block is missing."""
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


class MotionBlockStore(TrackBlockStore[MotionTrack, MotionBlock]):
    """Decoded blocks of one motion, of each the best rate that came."""

    def pose_at(self, position: int, loop: bool = True, duration: int | None = None) -> Pose | None:
        """The pose at motion time `position` in microseconds, None where its block is missing.

        Between the last frame of a block and the first of the next it is the mix of the two where the next is here, at
        the end of a loop too where the track is as long as the motion, which lasts `duration` microseconds (its own
        length, if not said); past the end of a shorter one it stands still.
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

    def rotations_at(self, positions: list[int], loop: bool = True, duration: int | None = None) -> list[Array | None]:
        """The rotations (18, 4) of `pose_at` at some motion times at once, which costs little more than one."""
        found: list[Array | None] = [None] * len(positions)
        together: dict[tuple[int, bool], tuple[MotionBlock, MotionBlock | None, list[int], list[float]]] = {}
        for nth, position in enumerate(positions):
            place = self._find_block(position, loop, duration)
            if place is None:
                continue
            block, instant, following = place
            members = together.setdefault((id(block), following is None), (block, following, [], []))
            members[2].append(nth)
            members[3].append(instant)
        for block, following, numbers, instants in together.values():
            for nth, rotations in zip(
                numbers, _interpolate_rotations(block, following, np.array(instants)), strict=True
            ):
                found[nth] = rotations
        return found


def _interpolate_rotations(block: MotionBlock, following: MotionBlock | None, instants: Array) -> Array:
    """Rotations (m, 18, 4) at `instants` (m,) of a block, or between its last frame and the `following` one's first."""
    if following is None:
        return block.pose_at(instants)[1]
    last, first = block.pose_at(block.frames - 1.0)[1][0], following.pose_at(0.0)[1][0]
    mix = np.minimum(instants - (block.frames - 1), 1.0)
    return rotation.slerp(last, first, np.repeat(mix[:, None], len(last), axis=1))


class SceneBlockStore(TrackBlockStore[SceneTrack, SceneBlock]):
    """Decoded blocks of one camera or light, of each the best rate that came."""

    def scene_at(self, position: int, loop: bool, duration: int) -> Array | None:
        """The seven numbers (7,) at `position` of a motion of `duration` microseconds, None where the block is missing.

        Between blocks they are the linear mix, at the end of a loop too where the track is as long as the motion; past
        the end of a shorter one they stand still.
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
