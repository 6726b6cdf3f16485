"""A camera or light to blocks at several rates, each within its error (SPEC.md, Tracks `camera` and `light`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bunraku.codec import coefficients, transform
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
"""Largest weighted error of each rate at any frame, mm, lowest rate first; as many as a motion has by itself."""
_MIN_STEP, _MAX_STEP = 0, 255
_ROUNDING_OFFSETS = 0.5, 0.4, 0.3, 0.2
"""What is added to a coefficient before it is rounded down: the less, the more zeros, but at a finer step."""
_COARSE_STEP_STRIDE = 16
"""Steps are tried so far apart first, all at once, then all between two of these."""
_EXTRA_STEPS = 8
"""Steps that are tried past those."""


@dataclass(frozen=True, slots=True)
class EncodedScene:
    """A camera or light at every rate, lowest first; errors of a rate are weighted ones, mm."""

    track: SceneTrack
    ladder: list[BitrateLevel]

    def describe(self) -> dict[str, Any]:
        """What a Description says of this track."""
        rates = [
            {"kbps": round(r.kbps, 3), "mean": round(r.mean_error_mm, 3), "max": r.error_bound_mm} for r in self.ladder
        ]
        return describe_scene_track(self.track, rates)


def encode_scene(
    scene: SceneSamples,
    block_seconds: float = 1.0,
    error_bounds_mm: tuple[float, ...] = SCENE_ERROR_BOUNDS_MM,
    first_seconds: float | None = None,
    prior: Prior | None = None,
) -> EncodedScene:
    """Encode `scene` in independent blocks, timed as a motion's with the same seconds, at every largest weighted error
    of `ladder` (mm); each block is checked by decoding it.

    Raises ValueError for a scene that no step can hold to its error.
    """
    track = plan_scene_track(scene, plan_timing(scene.fps, len(scene.values), block_seconds, first_seconds))
    rates = []
    for bound in error_bounds_mm:
        blocks = [
            _encode_scene_block(track, scene, index, bound, prior or load_shipped_prior())
            for index in range(track.block_count)
        ]
        error = np.concatenate([measure_scene_error(track, scene, i, block, prior) for i, block in enumerate(blocks)])
        kbps = sum(map(len, blocks)) * 8e-3 * scene.fps / track.frames
        rates.append(BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), float(bound)))
    return EncodedScene(track, rates)


def measure_scene_error(
    track: SceneTrack, scene: SceneSamples, index: int, block: bytes, prior: Prior | None = None
) -> Array:
    """How far the channels (n, 3) of block `index` are off when decoded: weighted, mm."""
    start, frames = track.first_frame(index), track.frames_in(index)
    values = decode_scene_block(track, block, prior).values_at(np.arange(frames, dtype=np.float64))
    off = track.to_channels(values) - track.to_channels(scene.values[start : start + frames])
    error: Array = np.linalg.norm(off, axis=-1) * 1e3
    return error


def _encode_scene_block(
    track: SceneTrack, scene: SceneSamples, index: int, error_bound_mm: float, prior: Prior
) -> bytes:
    """The smallest block found with no channel more than `bound` mm off at any frame."""
    start, frames = track.first_frame(index), track.frames_in(index)
    truth = track.to_channels(scene.values[start : start + frames])
    found: list[bytes] = []
    for rounding in _ROUNDING_OFFSETS:
        tried = _StepSearch(truth, rounding)
        step = tried.find_coarsest_step(error_bound_mm)
        if step is None:
            continue
        head = BlockHeader(frames, step, 0)
        data = coefficients.encode_coefficients(prior, head, tried.quantise(step), track.block_frames, track.fps)
        if measure_scene_error(track, scene, index, data, prior).max() <= error_bound_mm:
            found.append(data)
    if not found:
        raise ValueError(f"block {index} of the {track.kind} cannot be held to {error_bound_mm} mm at the finest step")
    return min(found, key=len)


class _StepSearch:
    """Steps tried on one block's channels (n, 3, 3) with one rounding."""

    def __init__(self, truth: Array, rounding: float) -> None:
        self._truth, self._rounding, self._frames = truth, rounding, len(truth)
        self._spectrum = transform.forward_dct(truth)
        self._basis = transform.cosine_basis(self._frames, self._frames, np.arange(self._frames, dtype=np.float64))

    def quantise(self, step: int) -> IntArray:
        """Coefficients (3, 3, n) at step index `step`."""
        whole: IntArray = self._quantise_steps(np.array([step]))[0]
        return whole

    def find_coarsest_step(self, error_bound_mm: float) -> int | None:
        """The coarsest step found that holds `bound` mm: errors rise with the step, but not evenly, so some steps
        beyond the first that does not hold are tried too."""
        apart = np.arange(_MIN_STEP, _MAX_STEP + 1, _COARSE_STEP_STRIDE)
        holding = self._meets_bound(apart, error_bound_mm)
        last = int(np.argmin(holding)) if not holding.all() else len(apart)
        begin = int(apart[last - 1]) if last else _MIN_STEP
        near = np.arange(begin, min(begin + _COARSE_STEP_STRIDE + _EXTRA_STEPS, _MAX_STEP) + 1)
        good = near[self._meets_bound(near, error_bound_mm)]
        return int(good[-1]) if len(good) else None

    def _quantise_steps(self, steps: IntArray) -> IntArray:
        sizes = np.array([step_size(int(step), self._frames) for step in steps])[:, None, None, None]
        whole: IntArray = (np.sign(self._spectrum) * np.floor(np.abs(self._spectrum) / sizes + self._rounding)).astype(
            np.int64
        )
        return whole

    def _meets_bound(self, steps: IntArray, error_bound_mm: float) -> npt.NDArray[np.bool_]:
        """Of each of some steps, whether no channel is more than `bound` mm off at any frame."""
        sizes = np.array([step_size(int(step), self._frames) for step in steps])[:, None, None, None]
        shown = (reconstruct(self._quantise_steps(steps)) * sizes) @ self._basis.T
        off = np.linalg.norm(np.moveaxis(shown, -1, 1) - self._truth, axis=-1)
        held: npt.NDArray[np.bool_] = off.max(axis=(1, 2)) * 1e3 <= error_bound_mm * (1 - 1e-6)
        return held
