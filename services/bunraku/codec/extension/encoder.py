"""Encoder of extensions at several bitrate levels (proto/codec.md, 2.17-2.19)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.extension.scale_offsets import MAX_SCALE_OFFSET, MIN_SCALE_OFFSET, SCALE_UNIT
from bunraku.codec.extension.track import (
    Extension,
    ExtensionPart,
    ExtensionTrack,
    decode_extension_block,
    describe_extension_track,
    part_of,
)
from bunraku.codec.motion_encoder import BitrateLevel
from bunraku.codec.motion_track import BASE_STEP_M, step_size
from bunraku.codec.prior import IntArray, load_shipped_prior
from bunraku.codec.timing import Timing
from bunraku.kernels import load_kernels
from bunraku.motion.extension import BodyExtension
from bunraku.motion.face import Face
from bunraku.motion.hands import Hands
from bunraku.motion.rotation import Array

_MAX_STEP = 255
_BIT_PRICE = 0.2
"""Squared error, in squared quantiser steps, that saving one bit is worth."""


class _Quality(NamedTuple):
    """Quantiser step of a part, as a multiple of the motion's mean error within limits in millimetres.

    A step of a face is in shares of the range of its expressions.
    """

    step_per_mm: float
    finest_mm: float
    coarsest_mm: float


_QUALITIES = {
    ExtensionPart.BODY: _Quality(2.8e-3, 1e-3, 1e3),
    ExtensionPart.FINGERS: _Quality(4.2e-3, 1.0, 6.0),
    ExtensionPart.FACE: _Quality(0.07, 0.5, 4.0),
}
"""A finer step of the body costs more bytes than it gains. A person who watches the whole figure sees no finger that is
1 mm, and no expression that is half a percent from where it is."""


@dataclass(frozen=True, slots=True)
class EncodedExtension:
    """An extension at every bitrate level, lowest first.

    Errors are of the weighted values: in millimetres, those of a face in thousandths of the range of its expressions.
    """

    track: ExtensionTrack
    ladder: list[BitrateLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_extension_track(self.track, [level.describe() for level in self.ladder])


def warm_up() -> None:
    """Load the code of the encoder, or compile it if it is not cached."""
    encode_extension(Face((0,)), np.zeros((2, 1, 3)), Timing(30.0, 2, 2, 2), [10.0])


def encode_extension(
    extension: Extension, values: Array, timing: Timing, mean_errors_mm: Sequence[float], performer: int = 0
) -> EncodedExtension:
    """Encode an extension in the blocks of its motion.

    Args:
        extension: Joints or axes of the extension.
        values: Values (n, E, 3) of the channels in each frame.
        timing: Blocks of the motion.
        mean_errors_mm: Mean error of each level of the motion, lowest first, to which that of the extension is adapted.
        performer: Index of the performer that is extended.

    Raises:
        ValueError: A value is too large for the level's step.
    """
    quality = _QUALITIES[part_of(extension)]
    steps = [_choose_step(quality, error_mm) for error_mm in mean_errors_mm]
    offsets = np.zeros(_count_offsets(extension), dtype=np.int64)
    track = ExtensionTrack(
        timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, extension, offsets
    )
    weighted = np.einsum("eij,nej->nei", track.weights, values)
    if len(offsets):
        # for all levels, those of the middle one
        track = replace(track, scale_offsets=_choose_offsets(track, weighted, steps[len(steps) // 2]))
    return EncodedExtension(track, [_encode_level(track, weighted, step) for step in steps])


def _count_offsets(extension: Extension) -> int:
    """Return how many axes of an extension have an offset of their scale."""
    match extension:
        case Hands():
            return 3 * len(extension.joints)
        case Face():
            return len(extension.axes)
        case BodyExtension():
            return 0


def _choose_step(quality: _Quality, mean_error_mm: float) -> int:
    error_mm = min(max(mean_error_mm, quality.finest_mm), quality.coarsest_mm)
    ideal = np.log2(quality.step_per_mm * error_mm / BASE_STEP_M)
    return min(max(round(16 * float(ideal)), 0), _MAX_STEP)


def _choose_offsets(track: ExtensionTrack, weighted: Array, step: int) -> IntArray:
    """Return the offset of each axis with which its coefficients take the fewest bits."""
    kernels, prior = load_kernels("codec"), load_shipped_prior()
    costs = kernels.build_cost_table(prior)
    offsets = np.arange(MIN_SCALE_OFFSET, MAX_SCALE_OFFSET + 1)
    totals = np.zeros((*weighted.shape[1:], len(offsets)))
    for index in range(track.block_count):
        q = _quantise_block(track, weighted, index, step)
        level = coefficients.duration_level(track.frames_in(index), track.fps)
        context = kernels.create_context_model(prior, track.layout, q.shape[2], step, level)
        kernels.add_offset_costs(context, costs, q, SCALE_UNIT * offsets, totals)
    chosen: IntArray = offsets[totals.reshape(-1, len(offsets)).argmin(axis=1)]
    return chosen[: len(track.scale_offsets)]


def _quantise_block(track: ExtensionTrack, weighted: Array, index: int, step: int) -> IntArray:
    """Return the coefficients (E, 3, K) of a block of weighted values (n, E, 3), up to the last that is not zero."""
    kernels, prior = load_kernels("codec"), load_shipped_prior()
    start, frames = track.first_frame(index), track.frames_in(index)
    spectrum = transform.forward_dct(weighted[start : start + frames]) / step_size(step, frames)
    # of one memory layout, so that the kernels that `warm_up` compiled take it
    spectrum = np.ascontiguousarray(spectrum)
    level = coefficients.duration_level(frames, track.fps)
    context = kernels.create_context_model(prior, track.layout, frames, step, level)
    q = np.zeros(spectrum.shape, dtype=np.int64)
    kernels.quantise_values(context, kernels.build_cost_table(prior), spectrum, _BIT_PRICE, q)
    used = np.flatnonzero(q.any(axis=(0, 1)))
    return np.ascontiguousarray(q[:, :, : used[-1] + 1 if len(used) else 0])


def _encode_level(track: ExtensionTrack, weighted: Array, step: int) -> BitrateLevel:
    """Encode weighted values (n, E, 3) with one step for all blocks."""
    blocks, errors = [], []
    for index in range(track.block_count):
        start, frames = track.first_frame(index), track.frames_in(index)
        q = _quantise_block(track, weighted, index, step)
        block = coefficients.encode_coefficients(
            load_shipped_prior(), BlockHeader(frames, step, 0), q, track.block_frames, track.fps, track.layout
        )
        decoded = decode_extension_block(track, block).values_at(np.arange(float(frames)))
        restored = np.einsum("eij,nej->nei", track.weights, decoded)
        errors.append(1e3 * np.linalg.norm(restored - weighted[start : start + frames], axis=-1))
        blocks.append(block)
    error = np.concatenate(errors)
    kbps = sum(map(len, blocks)) * 8e-3 * track.fps / track.frames
    return BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), round(float(error.max()), 3))
