"""Division of a track into blocks over time, the same for motion, scene and audio (proto/messages.md, 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import MAX_BLOCK_FRAMES

MAX_FPS = 100_000
"""Limit of the frame rate: instants are integer microseconds."""
MAX_BLOCKS = 86_400
"""Limit of the blocks of a track: one day of blocks of 1 s."""
MAX_DURATION_US = 1 << 48
"""Durations of tracks are below this."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Frames and blocks of a track.

    The first block has `first_frames` frames, all others `block_frames`; the last may be shorter.
    """

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
        """Duration in microseconds."""
        return round(self.frames * 1e6 / self.fps)

    def first_frame(self, index: int) -> int:
        """Return the frame of the motion with which block `index` starts."""
        return self.first_frames + (index - 1) * self.block_frames if index > 0 else 0

    def frames_in(self, index: int) -> int:
        """Return the number of frames of block `index`."""
        if index == 0:
            return self.first_frames
        return min(self.block_frames, self.frames - self.first_frame(index))

    def start_us(self, index: int) -> int:
        """Return the motion time of the first frame of block `index`, microseconds."""
        return round(self.first_frame(index) * 1e6 / self.fps)

    def block_at(self, position_us: float) -> int:
        """Return the index of the block at a motion time, limited to the blocks of the track."""
        # a start is rounded to the microsecond and may be slightly before its frame
        frame = (position_us + 1) * self.fps / 1e6
        index = int((frame - self.first_frames) // self.block_frames) + 1 if frame >= self.first_frames else 0
        return min(max(index, 0), self.block_count - 1)

    def describe_timing(self) -> dict[str, float]:
        """Return what `parse_timing` reads of an entry of a Description's `tracks` (proto/messages.md, 3.2)."""
        return {
            "fps": self.fps,
            "frames": self.frames,
            "block_frames": self.block_frames,
            "first_frames": self.first_frames,
        }


def plan_timing(fps: float, frames: int, block_seconds: float = 1.0, first_seconds: float | None = None) -> Timing:
    """Divide `frames` frames into even blocks of about `block_seconds`, the first of `first_seconds` if given.

    A different first block adds no block: the others are up to twice as long instead, and a single block stays one.
    """
    count = max(1, round(frames / (block_seconds * fps)))
    first = 0
    if first_seconds is not None and count > 1:
        first = min(max(1, round(first_seconds * fps)), frames, MAX_BLOCK_FRAMES)
        count -= 1
    block_frames = min(max(1, -(-(frames - first) // count)), MAX_BLOCK_FRAMES)
    return Timing(fps, frames, block_frames, first or min(block_frames, frames))


def parse_timing(description: dict[str, Any], track_name: str) -> Timing:
    """Return the timing in a Description's map of a track. Raises `DamagedBlock`; its message has `track_name`."""
    fps = description.get("fps")
    frames, block_frames, first_frames = (description.get(key) for key in ("frames", "block_frames", "first_frames"))
    if not (
        isinstance(fps, float | int)
        and isinstance(frames, int)
        and isinstance(block_frames, int)
        and isinstance(first_frames, int)
    ):
        raise DamagedBlock(
            f"Invalid {track_name} track: fps must be a number; frames, block_frames and first_frames integers."
        )
    if not (
        0 < fps <= MAX_FPS
        and 0 < first_frames <= min(frames, MAX_BLOCK_FRAMES)
        and 0 < block_frames <= MAX_BLOCK_FRAMES
    ):
        raise DamagedBlock(
            f"Invalid {track_name} track: expected fps above zero and at most {MAX_FPS}, frames above zero, "
            f"block_frames of 1..{MAX_BLOCK_FRAMES}, and first_frames of 1..{MAX_BLOCK_FRAMES} and at most frames."
        )
    if frames > MAX_BLOCKS * block_frames or frames * 1e6 / fps >= MAX_DURATION_US:
        raise DamagedBlock(
            f"Invalid {track_name} track: at most {MAX_BLOCKS} blocks and less than 2^48 microseconds are allowed."
        )
    return Timing(float(fps), frames, block_frames, first_frames)
