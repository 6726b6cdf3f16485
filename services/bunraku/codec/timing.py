"""When the blocks of a track are: the same of a motion and of the scene about it (SPEC.md, Description)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import MAX_BLOCK_FRAMES

MAX_FPS = 100_000
"""Frames a second, at most: instants are whole microseconds."""
MAX_BLOCKS = 86_400
"""Of a track: a day of seconds."""
MAX_DURATION_US = 1 << 48
"""A track is shorter."""


@dataclass(frozen=True, slots=True)
class Timing:
    """A track of `frames` frames, `fps` a second; the first block has `first_frames` frames, every other but perhaps
    the last `block_frames`."""

    fps: float
    frames: int
    block_frames: int
    first_frames: int

    @property
    def block_count(self) -> int:
        """Number of blocks."""
        return 1 - (-(self.frames - self.first_frames) // self.block_frames)

    @property
    def duration_us(self) -> int:
        """Length in microseconds."""
        return round(self.frames * 1e6 / self.fps)

    def first_frame(self, index: int) -> int:
        """Frame of the motion with which block `index` starts."""
        return self.first_frames + (index - 1) * self.block_frames if index > 0 else 0

    def frames_in(self, index: int) -> int:
        """Frames of block `index`."""
        if index == 0:
            return self.first_frames
        return min(self.block_frames, self.frames - self.first_frame(index))

    def start_us(self, index: int) -> int:
        """Motion time of the first frame of block `index`, microseconds."""
        return round(self.first_frame(index) * 1e6 / self.fps)

    def block_at(self, position_us: float) -> int:
        """Index of the block that holds the instant `position_us`, kept within the motion."""
        # a start is rounded to the microsecond, and may be a little before its frame
        frame = (position_us + 1) * self.fps / 1e6
        index = int((frame - self.first_frames) // self.block_frames) + 1 if frame >= self.first_frames else 0
        return min(max(index, 0), self.block_count - 1)


def plan_timing(fps: float, frames: int, block_seconds: float = 1.0, first_seconds: float | None = None) -> Timing:
    """`frames` frames in even blocks of about `block_seconds`, the first of `first_seconds` where that is given."""
    first = 0 if first_seconds is None else min(max(1, round(first_seconds * fps)), frames, MAX_BLOCK_FRAMES)
    pieces = max(1, round((frames - first) / (block_seconds * fps)))
    block_frames = min(max(1, -(-(frames - first) // pieces)), MAX_BLOCK_FRAMES)
    return Timing(fps, frames, block_frames, first or min(block_frames, frames))


def parse_timing(description: dict[str, Any], track_name: str) -> Timing:
    """The timing that a Description's map of a track (`what`, for the message) tells; raises `DamagedBlock`."""
    fps = description.get("fps")
    frames, block_frames, first_frames = (description.get(key) for key in ("frames", "block_frames", "first_frames"))
    if not (
        isinstance(fps, float | int)
        and isinstance(frames, int)
        and isinstance(block_frames, int)
        and isinstance(first_frames, int)
    ):
        raise DamagedBlock(f"a {track_name}'s track has numbers fps, frames, block_frames and first_frames")
    if not (
        0 < fps <= MAX_FPS
        and 0 < first_frames <= min(frames, MAX_BLOCK_FRAMES)
        and 0 < block_frames <= MAX_BLOCK_FRAMES
    ):
        raise DamagedBlock(
            f"a {track_name}'s track has fps above zero, at most {MAX_FPS}, frames above zero and blocks of "
            f"1..{MAX_BLOCK_FRAMES} frames"
        )
    if frames > MAX_BLOCKS * block_frames or frames * 1e6 / fps >= MAX_DURATION_US:
        raise DamagedBlock(f"a {track_name} has at most {MAX_BLOCKS} blocks and less than 2^48 microseconds")
    return Timing(float(fps), frames, block_frames, first_frames)
