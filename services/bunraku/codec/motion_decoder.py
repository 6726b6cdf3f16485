"""A motion block to poses at any instant (SPEC.md, Motion block)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.motion_track import MotionTrack, step_size
from bunraku.codec.prior import IntArray, Prior, load_shipped_prior
from bunraku.motion import rotation
from bunraku.motion.rotation import Array


@dataclass(frozen=True, slots=True)
class MotionBlock:
    """A decoded block: `frames` frames, quantised `q` (19, 3, K), their values (19, 3, K) in metres and radians, and
    the rotations they are relative to (18, 4)."""

    frames: int
    q: IntArray
    values: Array
    reference: Array

    def pose_at(self, instants: Array | float) -> tuple[Array, Array]:
        """Root positions (m, 3) in metres and rotations (m, 18, 4) at `instants` (m,), in frames from the block's
        first; any real in -1/2 .. frames - 1/2."""
        tracks = transform.inverse_dct(self.values, self.frames, np.atleast_1d(np.asarray(instants, dtype=np.float64)))
        turned = rotation.from_rotation_vector(tracks[:, 1:])
        return tracks[:, 0], rotation.multiply(np.broadcast_to(self.reference, turned.shape), turned)


def reconstruct(q: IntArray) -> Array:
    """Values of quantised coefficients, in steps: a little below the middle, where values are denser (SPEC.md)."""
    size = np.abs(q)
    values: Array = np.sign(q) * (size - np.where(size == 1, 0.06, 0.03))
    return values


def decode_motion_block(track: MotionTrack, data: bytes, prior: Prior | None = None) -> MotionBlock:
    """Decode one block of `track`; raises `DamagedBlock` on what cannot be one.

    `prior` is the package's own unless another is given; nothing but the same prior decodes a block.
    """
    head, q = coefficients.decode_coefficients(prior or load_shipped_prior(), data, track.block_frames, track.fps)
    size = step_size(head.step, head.frames)
    values = track.inverse_weights @ (reconstruct(q) * size)
    return MotionBlock(head.frames, q, values, track.reference_rotations(head.heading))


def warm_up() -> None:
    """Load or compile what decoding needs."""
    coefficients.warm_up(load_shipped_prior())
