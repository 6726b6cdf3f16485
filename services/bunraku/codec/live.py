"""Blocks of a few frames for the poses of live performers (proto/codec.md, 2.16)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_decoder import MotionBlock, decode_motion_block
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.skeleton_description import SkeletonDescription
from bunraku.codec.step_search import MAX_STEP, MIN_STEP
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Motion

LIVE_FPS = 60.0
"""Frame rate of live poses, that of overlays."""
TARGET_ERROR_MM = 1.0
"""Mean error that the step index is controlled to: with coarser steps, slow movements tremble visibly."""
_INITIAL_STEP = 144.0
_MAX_STEP_CHANGE = 4.0
"""Largest change of the step index between two blocks, so that quality does not jump."""
_STEPS_PER_OCTAVE = 16
_CONTROL_GAIN = 0.25
"""Share of the deviation from the target that one block corrects: single blocks vary."""
_TOLERANCE = 1.4
"""Ratio to the target within which the step stays: a still pose keeps its block and does not tremble."""


class LiveTrack:
    """Skeleton of a live performer, as blocks of any number of frames need it."""

    def __init__(self, skeleton: SkeletonDescription) -> None:
        self._skeleton = skeleton
        self._tracks: dict[int, MotionTrack] = {}

    def track(self, frames: int) -> MotionTrack:
        """Return the track of a block of `frames` frames, 1 to 16."""
        track = self._tracks.get(frames)
        if track is None:
            # kept, because its weights take milliseconds
            track = self._tracks[frames] = MotionTrack(LIVE_FPS, frames, frames, frames, self._skeleton)
        return track

    def decode(self, frames: int, block: bytes) -> MotionBlock:
        """Decode a block of `frames` frames. Raises `DamagedBlock`."""
        decoded = decode_motion_block(self.track(frames), block)
        if decoded.frames != frames:
            raise DamagedBlock(f"A live block has {decoded.frames} frames, its message {frames}.")
        return decoded


@dataclass(frozen=True, slots=True)
class EncodedFrames:
    """A block, and its mean error over points and frames in mm."""

    data: bytes
    mean_error_mm: float


class LiveEncoder:
    """Encoder of one live performer. Its step follows a target for the mean error."""

    def __init__(self, skeleton: SkeletonDescription) -> None:
        self.live_track = LiveTrack(skeleton)
        self._prior = load_shipped_prior()
        self._step = _INITIAL_STEP

    def encode(self, root: Array, rotations: Array) -> EncodedFrames:
        """Encode n frames, 1 to 16: `root` (n, 3) in metres and `rotations` (n, 18, 4)."""
        track = self.live_track.track(len(root))
        motion = Motion(track.figure, LIVE_FPS, root, rotations)
        encoded = BlockEncoder(track, motion, self._prior).encode_block(0, round(self._step))
        error_mm = float(encoded.errors_mm.mean())
        self._adapt_step(error_mm)
        return EncodedFrames(encoded.data, error_mm)

    def _adapt_step(self, error_mm: float) -> None:
        octaves = math.log2(TARGET_ERROR_MM / max(error_mm, 1e-3))
        if abs(octaves) > math.log2(_TOLERANCE):
            change = octaves * _STEPS_PER_OCTAVE * _CONTROL_GAIN
            self._step += min(max(change, -_MAX_STEP_CHANGE), _MAX_STEP_CHANGE)
            self._step = min(max(self._step, MIN_STEP), MAX_STEP)
