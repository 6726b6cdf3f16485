"""A camera or light to blocks at several rates, each within its error (SPEC.md, Tracks `camera` and `light`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bunraku.codec import coefficients, transform
from bunraku.codec.coefficients import Head
from bunraku.codec.decode import reconstruct
from bunraku.codec.encode import Rate
from bunraku.codec.prior import Integers, Prior, shipped
from bunraku.codec.scene import Scene, SceneTrack, describe_scene, plan_scene
from bunraku.codec.scene_decode import decode_scene
from bunraku.codec.timing import even_blocks
from bunraku.codec.track import step_size
from bunraku.motion.rotation import Array

SCENE_LADDER: tuple[float, ...] = (40.0, 20.0, 10.0, 4.0, 1.0)
"""Largest weighted error of each rate at any frame, mm, lowest rate first; as many as a motion has by itself."""
_FINEST, _COARSEST = 0, 255
_ROUNDINGS = 0.5, 0.4, 0.3, 0.2
"""What is added to a coefficient before it is rounded down: the less, the more zeros, but at a finer step."""
_APART = 16
"""Steps are tried so far apart first, all at once, then all between two of these."""
_BEYOND = 8
"""Steps that are tried past those."""


@dataclass(frozen=True, slots=True)
class EncodedScene:
    """A camera or light at every rate, lowest first; errors of a rate are weighted ones, mm."""

    track: SceneTrack
    rates: list[Rate]

    def describe(self) -> dict[str, Any]:
        """What a Description says of this track."""
        rates = [{"kbps": round(r.kbps, 3), "mean": round(r.mean, 3), "max": r.bound} for r in self.rates]
        return describe_scene(self.track, rates)


def encode_scene(
    scene: Scene,
    block_seconds: float = 1.0,
    ladder: tuple[float, ...] = SCENE_LADDER,
    first_seconds: float | None = None,
    prior: Prior | None = None,
) -> EncodedScene:
    """Encode `scene` in independent blocks, timed as a motion's with the same seconds, at every largest weighted error
    of `ladder` (mm); each block is checked by decoding it.

    Raises ValueError for a scene that no step can hold to its error.
    """
    track = plan_scene(scene, even_blocks(scene.fps, len(scene.values), block_seconds, first_seconds))
    rates = []
    for bound in ladder:
        blocks = [_bounded(track, scene, index, bound, prior or shipped()) for index in range(track.blocks)]
        error = np.concatenate([scene_error(track, scene, i, block, prior) for i, block in enumerate(blocks)])
        kbps = sum(map(len, blocks)) * 8e-3 * scene.fps / track.frames
        rates.append(Rate(blocks, kbps, float(error.mean()), float(error.max()), float(bound)))
    return EncodedScene(track, rates)


def scene_error(track: SceneTrack, scene: Scene, index: int, block: bytes, prior: Prior | None = None) -> Array:
    """How far the channels (n, 3) of block `index` are off when decoded: weighted, mm."""
    start, frames = track.first_frame(index), track.frames_in(index)
    values = decode_scene(track, block, prior).at(np.arange(frames, dtype=np.float64))
    off = track.coded(values) - track.coded(scene.values[start : start + frames])
    error: Array = np.linalg.norm(off, axis=-1) * 1e3
    return error


def _bounded(track: SceneTrack, scene: Scene, index: int, bound: float, prior: Prior) -> bytes:
    """The smallest block found with no channel more than `bound` mm off at any frame."""
    start, frames = track.first_frame(index), track.frames_in(index)
    truth = track.coded(scene.values[start : start + frames])
    found: list[bytes] = []
    for rounding in _ROUNDINGS:
        tried = _Tried(truth, rounding)
        step = tried.coarsest(bound)
        if step is None:
            continue
        head = Head(frames, step, 0)
        data = coefficients.encode(prior, head, tried.quantised(step), track.block_frames, track.fps)
        if scene_error(track, scene, index, data, prior).max() <= bound:
            found.append(data)
    if not found:
        raise ValueError(f"block {index} of the {track.kind} cannot be held to {bound} mm at the finest step")
    return min(found, key=len)


class _Tried:
    """Steps tried on one block's channels (n, 3, 3) with one rounding."""

    def __init__(self, truth: Array, rounding: float) -> None:
        self._truth, self._rounding, self._frames = truth, rounding, len(truth)
        self._spectrum = transform.forward(truth)
        self._basis = transform.basis(self._frames, self._frames, np.arange(self._frames, dtype=np.float64))

    def quantised(self, step: int) -> Integers:
        """Coefficients (3, 3, n) at step index `step`."""
        whole: Integers = self._all_quantised(np.array([step]))[0]
        return whole

    def coarsest(self, bound: float) -> int | None:
        """The coarsest step found that holds `bound` mm: errors rise with the step, but not evenly, so some steps
        beyond the first that does not hold are tried too."""
        apart = np.arange(_FINEST, _COARSEST + 1, _APART)
        holding = self._hold(apart, bound)
        last = int(np.argmin(holding)) if not holding.all() else len(apart)
        begin = int(apart[last - 1]) if last else _FINEST
        near = np.arange(begin, min(begin + _APART + _BEYOND, _COARSEST) + 1)
        good = near[self._hold(near, bound)]
        return int(good[-1]) if len(good) else None

    def _all_quantised(self, steps: Integers) -> Integers:
        sizes = np.array([step_size(int(step), self._frames) for step in steps])[:, None, None, None]
        whole: Integers = (np.sign(self._spectrum) * np.floor(np.abs(self._spectrum) / sizes + self._rounding)).astype(
            np.int64
        )
        return whole

    def _hold(self, steps: Integers, bound: float) -> npt.NDArray[np.bool_]:
        """Of each of some steps, whether no channel is more than `bound` mm off at any frame."""
        sizes = np.array([step_size(int(step), self._frames) for step in steps])[:, None, None, None]
        shown = (reconstruct(self._all_quantised(steps)) * sizes) @ self._basis.T
        off = np.linalg.norm(np.moveaxis(shown, -1, 1) - self._truth, axis=-1)
        held: npt.NDArray[np.bool_] = off.max(axis=(1, 2)) * 1e3 <= bound * (1 - 1e-6)
        return held
