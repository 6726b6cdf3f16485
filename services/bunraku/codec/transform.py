"""Cosine transform of channel values over time.

The orthonormal DCT-II over the n frames of a block: x(t) = sum_k s_k X_k cos(pi (t + 1/2) k / n), s_0 = sqrt(1/n),
s_k = sqrt(2/n). It is a function of continuous time, so that a viewer draws at its own frame rate
(proto/codec.md, 2.7).
"""

from __future__ import annotations

import math

import numpy as np

from bunraku.motion.rotation import Array


def cosine_basis(frames: int, count: int, instants: Array) -> Array:
    """Return the first `count` cosines (m, count) of a block of `frames` frames at `instants` (m,), in frames."""
    k = np.arange(count, dtype=np.float64)
    scale = np.full(count, np.sqrt(2.0 / frames))
    scale[:1] = np.sqrt(1.0 / frames)
    cosines: Array = scale * np.cos(np.pi / frames * (instants[:, None] + 0.5) * k)
    return cosines


def forward_dct(track: Array) -> Array:
    """Return the coefficients (..., n) of values (n, ...), one per frame."""
    frames = len(track)
    coefficients: Array = np.moveaxis(
        np.tensordot(cosine_basis(frames, frames, np.arange(frames, dtype=np.float64)), track, (0, 0)), 0, -1
    )
    return coefficients


def inverse_dct(coefficients: Array, frames: int, instants: Array) -> Array:
    """Evaluate a block at any instants.

    The value at an instant is the same to the last bit, whatever other instants are requested with it: a recording has
    the poses that viewers saw.

    Args:
        coefficients: (..., count).
        frames: Frames of the block.
        instants: (m,), in frames.

    Returns:
        Values (m, ...).
    """
    *shape, count = coefficients.shape
    flat = np.ascontiguousarray(coefficients.reshape(math.prod(shape), count))
    # not with BLAS: the order of its sums depends on the number of rows
    values: Array = np.einsum("mk,ck->mc", cosine_basis(frames, count, instants), flat)
    return values.reshape(len(instants), *shape)
