"""Encoder of extensions: further joints of a performer at several bitrate levels (proto/codec.md, 2.17)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.extension_track import ExtensionTrack, decode_extension_block, describe_extension_track
from bunraku.codec.motion_encoder import BitrateLevel
from bunraku.codec.motion_track import BASE_STEP_M, step_size
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.timing import Timing
from bunraku.motion.extension import BodyExtension
from bunraku.motion.rotation import Array

_STEP_PER_ERROR = 2.8
"""Quantiser step as a multiple of the mean error of the motion: a finer one costs more bytes than it gains."""
_ROUNDING_OFFSET = 0.4
"""Offset that is added to a magnitude before it is rounded down."""
_MAX_STEP = 255


@dataclass(frozen=True, slots=True)
class EncodedExtension:
    """An extension at every bitrate level, lowest first."""

    track: ExtensionTrack
    ladder: list[BitrateLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_extension_track(self.track, [level.describe() for level in self.ladder])


def encode_extension(
    extension: BodyExtension, values: Array, timing: Timing, mean_errors_mm: Sequence[float], performer: int = 0
) -> EncodedExtension:
    """Encode an extension in the blocks of its motion.

    Args:
        extension: Joints of the extension.
        values: Values (n, E, 3) of the joints in each frame, radians.
        timing: Blocks of the motion.
        mean_errors_mm: Mean error of each level of the motion, lowest first, to which that of the extension is adapted.
        performer: Index of the performer that is extended.

    Raises:
        ValueError: A value is too large for the level's step.
    """
    track = ExtensionTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, extension)
    weighted = np.einsum("eij,nej->nei", track.weights, values)
    return EncodedExtension(track, [_encode_level(track, weighted, error_mm) for error_mm in mean_errors_mm])


def _encode_level(track: ExtensionTrack, weighted: Array, mean_error_mm: float) -> BitrateLevel:
    """Encode weighted values (n, E, 3), in metres, with one step for all blocks."""
    ideal = np.log2(_STEP_PER_ERROR * max(mean_error_mm, 1e-3) * 1e-3 / BASE_STEP_M)
    step = min(max(round(16 * float(ideal)), 0), _MAX_STEP)
    blocks, errors = [], []
    for index in range(track.block_count):
        start, frames = track.first_frame(index), track.frames_in(index)
        truth = weighted[start : start + frames]
        spectrum = transform.forward_dct(truth) / step_size(step, frames)
        q = (np.sign(spectrum) * np.floor(np.abs(spectrum) + _ROUNDING_OFFSET)).astype(np.int64)
        block = coefficients.encode_coefficients(
            load_shipped_prior(), BlockHeader(frames, step, 0), q, track.block_frames, track.fps, track.layout
        )
        decoded = decode_extension_block(track, block).values_at(np.arange(float(frames)))
        errors.append(1e3 * np.linalg.norm(np.einsum("eij,nej->nei", track.weights, decoded) - truth, axis=-1))
        blocks.append(block)
    error = np.concatenate(errors)
    kbps = sum(map(len, blocks)) * 8e-3 * track.fps / track.frames
    return BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), round(float(error.max()), 3))
