"""The blocks a viewer holds, and the dance's pose at any instant (SPEC.md, Motion block)."""

from __future__ import annotations

import numpy as np

from bunraku.codec.decode import MotionBlock
from bunraku.codec.track import MotionTrack
from bunraku.motion import rotation
from bunraku.motion.rotation import Array

Pose = tuple[Array, Array]
"""Root position (3,) in metres and joint rotations (18, 4), each in its parent's frame."""


class BlockStore:
    """Decoded blocks of one motion, of each the best rate that came."""

    def __init__(self, track: MotionTrack) -> None:
        self.track = track
        self._blocks: dict[int, tuple[int, MotionBlock]] = {}

    def put(self, index: int, rate: int, block: MotionBlock) -> bool:
        """Keep a block unless a better one is here; whether it was kept. One that does not fit the track is refused
        with ValueError."""
        if not 0 <= index < self.track.blocks or block.frames != self.track.frames_in(index):
            raise ValueError(f"block {index} with {block.frames} frames is not of this motion")
        if index in self._blocks and self._blocks[index][0] > rate:
            return False
        self._blocks[index] = (rate, block)
        return True

    def rate(self, index: int) -> int:
        """The rate held of a block, -1 where it is missing."""
        return self._blocks[index][0] if index in self._blocks else -1

    def ahead(self, position: int, loop: bool) -> int:
        """Microseconds of motion that are here from `position` on without a gap, once around at most."""
        track, end = self.track, position
        first = track.block_at(position)
        for index in range(first, first + track.blocks if loop else track.blocks):
            turn, block = divmod(index, track.blocks)
            if block not in self._blocks:
                break
            end = turn * track.duration_us + min(track.start_us(block + 1), track.duration_us)
        return max(end - position, 0)

    def pose_at(self, position: int, loop: bool = True) -> Pose | None:
        """The pose at motion time `position` in microseconds, None where its block is missing.

        Between the last frame of a block and the first of the next it is the mix of the two where the next is here, at
        the end of a loop too.
        """
        track = self.track
        index = track.block_at(position)
        if index not in self._blocks:
            return None
        block = self._blocks[index][1]
        instant = position * track.fps / 1e6 - track.first_frame(index)
        past = instant - (block.frames - 1)
        following = index + 1 if index + 1 < track.blocks else 0 if loop else -1
        if past <= 0 or following not in self._blocks:
            root, rotations = block.at(np.clip(instant, -0.5, block.frames - 0.5))
            return root[0], rotations[0]
        (root, rotations), (next_root, next_rotations) = (
            block.at(block.frames - 1.0),
            self._blocks[following][1].at(0.0),
        )
        mix = min(past, 1.0)
        return (
            root[0] + mix * (next_root[0] - root[0]),
            rotation.slerp(rotations[0], next_rotations[0], np.full(len(rotations[0]), mix)),
        )
