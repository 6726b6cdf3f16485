"""Encoder of extensions: further joints of a performer at several bitrate levels (proto/codec.md, 2.17)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bunraku.codec.extension_track import ExtensionTrack, decode_extension_block, describe_extension_track
from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM, BitrateLevel
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.step_search import encode_channels
from bunraku.codec.timing import Timing
from bunraku.motion.extension import BodyExtension
from bunraku.motion.rotation import Array

_BOUND_SHARE = 0.6
"""Error bound of an extension, as a share of that of the motion at the same level: its errors add to the figure's."""


@dataclass(frozen=True, slots=True)
class EncodedExtension:
    """An extension at every bitrate level, lowest first."""

    track: ExtensionTrack
    ladder: list[BitrateLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_extension_track(self.track, [level.describe() for level in self.ladder])


def encode_extension(
    extension: BodyExtension,
    values: Array,
    timing: Timing,
    performer: int = 0,
    error_bounds_mm: tuple[float, ...] = ERROR_BOUNDS_MM,
) -> EncodedExtension:
    """Encode an extension in the blocks of its motion, and check each block by decoding it.

    Args:
        extension: Joints of the extension.
        values: Values (n, E, 3) of the joints in each frame, radians.
        timing: Blocks of the motion.
        performer: Index of the performer that is extended.
        error_bounds_mm: Error bounds of the motion's levels. Those of the extension are smaller, and hold for each
            joint's value as a distance: times the lever arm of what it carries.

    Raises:
        ValueError: The finest step does not meet a bound.
    """
    track = ExtensionTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, extension)
    weighted = np.einsum("eij,nej->nei", track.weights, values)
    ladder = []
    for error_bound_mm in error_bounds_mm:
        bound_mm = _BOUND_SHARE * error_bound_mm
        blocks, errors = [], []
        for index in range(track.block_count):
            start, frames = track.first_frame(index), track.frames_in(index)
            block, error = _encode_block(track, weighted[start : start + frames], bound_mm)
            blocks.append(block)
            errors.append(error)
        error = np.concatenate(errors)
        kbps = sum(map(len, blocks)) * 8e-3 * timing.fps / timing.frames
        ladder.append(BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), bound_mm))
    return EncodedExtension(track, ladder)


def _encode_block(track: ExtensionTrack, truth: Array, bound_mm: float) -> tuple[bytes, Array]:
    """Return the smallest block found of weighted values (n, E, 3) within the bound, and its errors (n, E) in mm."""
    candidates = []
    for data in encode_channels(truth, bound_mm, track, track.layout, load_shipped_prior()):
        values = decode_extension_block(track, data).values_at(np.arange(len(truth), dtype=np.float64))
        error: Array = 1e3 * np.linalg.norm(np.einsum("eij,nej->nei", track.weights, values) - truth, axis=-1)
        if error.max() <= bound_mm:
            candidates.append((data, error))
    if not candidates:
        raise ValueError(f"The extension cannot be encoded within {bound_mm} mm, even at the finest step.")
    return min(candidates, key=lambda candidate: len(candidate[0]))
