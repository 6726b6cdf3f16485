"""Decoder of motion blocks: bytes to poses at any instant (proto/codec.md, 2.8 and 2.9)."""

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
    """A decoded block.

    `q` (19, 3, K) are its quantised coefficients, `values` (19, 3, K) the dequantised ones in metres and radians, and
    `reference` (18, 4) the rotations that they are relative to.
    """

    frames: int
    q: IntArray
    values: Array
    reference: Array

    def pose_at(self, instants: Array | float) -> tuple[Array, Array]:
        """Evaluate the block at `instants` (m,), in frames from its first, any real in -1/2 .. frames - 1/2.

        Returns:
            Root positions (m, 3) in metres and rotations (m, 18, 4).
        """
        tracks = transform.inverse_dct(self.values, self.frames, np.atleast_1d(np.asarray(instants, dtype=np.float64)))
        turned = rotation.from_rotation_vector(tracks[:, 1:])
        return tracks[:, 0], rotation.multiply(np.broadcast_to(self.reference, turned.shape), turned)


def reconstruct(q: IntArray) -> Array:
    """Return the values of quantised coefficients in steps (proto/codec.md, 2.7).

    They lie a little below the middle of the quantiser's intervals, because smaller values are more frequent.
    """
    magnitude = np.abs(q)
    values: Array = np.sign(q) * (magnitude - np.where(magnitude == 1, 0.06, 0.03))
    return values


def decode_motion_block(track: MotionTrack, data: bytes, prior: Prior | None = None) -> MotionBlock:
    """Decode one block of `track`. Raises `DamagedBlock`.

    `prior` must be the one with which the block was encoded; the default is the shipped prior.
    """
    header, q = coefficients.decode_coefficients(prior or load_shipped_prior(), data, track.block_frames, track.fps)
    values = track.inverse_weights @ (reconstruct(q) * step_size(header.step, header.frames))
    return MotionBlock(header.frames, q, values, track.reference_rotations(header.heading))


def warm_up() -> None:
    """Load the code of the decoder, or compile it if it is not cached."""
    coefficients.warm_up(load_shipped_prior())
