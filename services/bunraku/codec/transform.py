"""Tracks over time to cosine coefficients, and back to any instant.

The orthonormal DCT-II over the n frames of a block: x(t) = sum_k s_k X_k cos(pi (t + 1/2) k / n), s_0 = sqrt(1/n),
s_k = sqrt(2/n). It is a function of continuous time, so a viewer draws at its own frame rate (SPEC.md, Transform).
"""

from __future__ import annotations

import math

import numpy as np

from bunraku.motion.rotation import Array


def cosine_basis(frames: int, count: int, instants: Array) -> Array:
    """The first `count` cosines (m, count) of a block of `frames` frames at `instants` (m,), in frames."""
    k = np.arange(count, dtype=np.float64)
    scale = np.full(count, np.sqrt(2.0 / frames))
    scale[:1] = np.sqrt(1.0 / frames)
    cosines: Array = scale * np.cos(np.pi / frames * (instants[:, None] + 0.5) * k)
    return cosines


def forward_dct(track: Array) -> Array:
    """Coefficients (..., n) of tracks (n, ...), one value a frame."""
    frames = len(track)
    coefficients: Array = np.moveaxis(
        np.tensordot(cosine_basis(frames, frames, np.arange(frames, dtype=np.float64)), track, (0, 0)), 0, -1
    )
    return coefficients


def inverse_dct(coefficients: Array, frames: int, instants: Array) -> Array:
    """Tracks (m, ...) at `instants` (m,), in frames, of coefficients (..., count) of a block of `frames` frames; each
    to the last bit the same, whatever other instants are asked for with it: a log replays to what was shown."""
    *shape, count = coefficients.shape
    flat = np.ascontiguousarray(coefficients.reshape(math.prod(shape), count))
    # not by BLAS, whose sums depend on how many there are
    tracks: Array = np.einsum("mk,ck->mc", cosine_basis(frames, count, instants), flat)
    return tracks.reshape(len(instants), *shape)
