"""Encoder of scenes: a camera or light at several bitrate levels (proto/codec.md, 2.14)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bunraku.codec import coefficients, transform
from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_encoder import BitrateLevel
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import IntArray, Prior, load_shipped_prior
from bunraku.codec.scene import SceneSamples, SceneTrack, describe_scene_track, plan_scene_track
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.timing import plan_timing
from bunraku.motion.rotation import Array

SCENE_ERROR_BOUNDS_MM: tuple[float, ...] = (40.0, 20.0, 10.0, 4.0, 1.0)
"""Largest weighted error of each bitrate level at any frame, lowest level first; as many levels as a motion has."""
_MIN_STEP, _MAX_STEP = 0, 255
_ROUNDING_OFFSETS = 0.5, 0.4, 0.3, 0.2
"""Offsets that are added to a magnitude before it is rounded down. A smaller one gives more zeros at a finer step."""
_COARSE_STEP_STRIDE = 16
"""Distance of the step indices that are tried first; the indices between two of them follow."""
_EXTRA_STEPS = 8
"""Further step indices that are tried."""
_BOUND_MARGIN = 1 - 1e-6


@dataclass(frozen=True, slots=True)
class EncodedScene:
    """A camera or light at every bitrate level, lowest first."""

    track: SceneTrack
    ladder: list[BitrateLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_scene_track(self.track, [level.describe() for level in self.ladder])


def encode_scene(
    scene: SceneSamples,
    block_seconds: float = 1.0,
    error_bounds_mm: tuple[float, ...] = SCENE_ERROR_BOUNDS_MM,
    first_seconds: float | None = None,
    prior: Prior | None = None,
) -> EncodedScene:
    """Encode a scene in independent blocks, and check each block by decoding it.

    Args:
        scene: The camera or light.
        block_seconds: Approximate length of the blocks; that of the motion keeps both in step.
        error_bounds_mm: Largest weighted error of each bitrate level.
        first_seconds: Length of the first block, if it differs.
        prior: Prior of the context model; the default is the shipped one.

    Raises:
        ValueError: The finest step does not meet a bound.
    """
    track = plan_scene_track(scene, plan_timing(scene.fps, len(scene.values), block_seconds, first_seconds))
    ladder = []
    for error_bound_mm in error_bounds_mm:
        blocks = [
            _encode_scene_block(track, scene, index, error_bound_mm, prior or load_shipped_prior())
            for index in range(track.block_count)
        ]
        error = np.concatenate([measure_scene_error(track, scene, i, block, prior) for i, block in enumerate(blocks)])
        kbps = sum(map(len, blocks)) * 8e-3 * scene.fps / track.frames
        ladder.append(BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), float(error_bound_mm)))
    return EncodedScene(track, ladder)


def measure_scene_error(
    track: SceneTrack, scene: SceneSamples, index: int, block: bytes, prior: Prior | None = None
) -> Array:
    """Return the weighted errors of the channels (n, 3) of block `index`, decoded, in mm."""
    start, frames = track.first_frame(index), track.frames_in(index)
    values = decode_scene_block(track, block, prior).values_at(np.arange(frames, dtype=np.float64))
    difference = track.to_channels(values) - track.to_channels(scene.values[start : start + frames])
    error: Array = np.linalg.norm(difference, axis=-1) * 1e3
    return error


def _encode_scene_block(
    track: SceneTrack, scene: SceneSamples, index: int, error_bound_mm: float, prior: Prior
) -> bytes:
    """Return the smallest block found of which no channel is more than `error_bound_mm` off at any frame."""
    start, frames = track.first_frame(index), track.frames_in(index)
    truth = track.to_channels(scene.values[start : start + frames])
    candidates: list[bytes] = []
    for rounding_offset in _ROUNDING_OFFSETS:
        search = _StepSearch(truth, rounding_offset)
        step = search.find_coarsest_step(error_bound_mm)
        if step is None:
            continue
        header = BlockHeader(frames, step, 0)
        q = search.quantise(step)
        data = coefficients.encode_coefficients(prior, header, q, track.block_frames, track.fps, SCENE_LAYOUT)
        if measure_scene_error(track, scene, index, data, prior).max() <= error_bound_mm:
            candidates.append(data)
    if not candidates:
        raise ValueError(
            f"Block {index} of the {track.kind} cannot be encoded within {error_bound_mm} mm, even at the finest step."
        )
    return min(candidates, key=len)


class _StepSearch:
    """Search for the quantiser step of one block's channels (n, 3, 3) with one rounding offset."""

    def __init__(self, truth: Array, rounding_offset: float) -> None:
        self._truth, self._rounding_offset, self._frames = truth, rounding_offset, len(truth)
        self._spectrum = transform.forward_dct(truth)
        self._basis = transform.cosine_basis(self._frames, self._frames, np.arange(self._frames, dtype=np.float64))

    def quantise(self, step: int) -> IntArray:
        """Return the coefficients (3, 3, n) at one step index."""
        q: IntArray = self._quantise_steps(np.array([step]))[0]
        return q

    def find_coarsest_step(self, error_bound_mm: float) -> int | None:
        """Return the coarsest step index found that meets a bound, or None.

        Errors grow with the step, but not monotonically, so a few steps beyond the first failure are tried too.
        """
        coarse = np.arange(_MIN_STEP, _MAX_STEP + 1, _COARSE_STEP_STRIDE)
        valid = self._meets_bound(coarse, error_bound_mm)
        first_failure = int(np.argmin(valid)) if not valid.all() else len(coarse)
        begin = int(coarse[first_failure - 1]) if first_failure else _MIN_STEP
        fine = np.arange(begin, min(begin + _COARSE_STEP_STRIDE + _EXTRA_STEPS, _MAX_STEP) + 1)
        valid_steps = fine[self._meets_bound(fine, error_bound_mm)]
        return int(valid_steps[-1]) if len(valid_steps) else None

    def _step_sizes(self, steps: IntArray) -> Array:
        return np.array([step_size(int(step), self._frames) for step in steps])[:, None, None, None]

    def _quantise_steps(self, steps: IntArray) -> IntArray:
        magnitudes = np.floor(np.abs(self._spectrum) / self._step_sizes(steps) + self._rounding_offset)
        q: IntArray = (np.sign(self._spectrum) * magnitudes).astype(np.int64)
        return q

    def _meets_bound(self, steps: IntArray, error_bound_mm: float) -> npt.NDArray[np.bool_]:
        """Return for each step whether no channel is more than `error_bound_mm` off at any frame."""
        decoded = (reconstruct(self._quantise_steps(steps)) * self._step_sizes(steps)) @ self._basis.T
        error = np.linalg.norm(np.moveaxis(decoded, -1, 1) - self._truth, axis=-1)
        valid: npt.NDArray[np.bool_] = error.max(axis=(1, 2)) * 1e3 <= error_bound_mm * _BOUND_MARGIN
        return valid
