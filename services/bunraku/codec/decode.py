"""A motion block to poses at any instant (SPEC.md, Motion block)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.coefficients import Integers
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.track import REFERENCE_UNIT, MotionTrack
from bunraku.motion import rotation
from bunraku.motion.rotation import Array

FORMAT = 1
HEADER = struct.Struct("<BBH3b")
LARGEST_BLOCK = 65_536
MOST_FRAMES = 1_000


@dataclass(frozen=True, slots=True)
class MotionBlock:
    """A decoded block: `frames` frames, quantised `q` (19, 3, K), their values, and the rotations they are relative to
    (18, 4)."""

    frames: int
    q: Integers
    values: Array
    reference: Array

    def at(self, instants: Array | float) -> tuple[Array, Array]:
        """Root positions (m, 3) in metres and rotations (m, 18, 4) at `instants` (m,), in frames from the block's
        first; any real in -1/2 .. frames - 1/2."""
        tracks = transform.inverse(self.values, self.frames, np.atleast_1d(np.asarray(instants, dtype=np.float64)))
        turned = rotation.from_rotation_vector(tracks[:, 1:])
        return tracks[:, 0], rotation.multiply(np.broadcast_to(self.reference, turned.shape), turned)


def decode_block(track: MotionTrack, data: bytes) -> MotionBlock:
    """Decode one block of `track`; raises `DamagedBlock` on anything that is not one."""
    if not HEADER.size <= len(data) <= LARGEST_BLOCK:
        raise DamagedBlock(f"a block has {HEADER.size}..{LARGEST_BLOCK} bytes, not {len(data)}")
    block_format, step, frames, x, y, z = HEADER.unpack_from(data)
    if block_format != FORMAT:
        raise DamagedBlock(f"block is of format {block_format}; this decoder reads {FORMAT}")
    if not 1 <= frames <= MOST_FRAMES:
        raise DamagedBlock(f"block says {frames} frames; 1..{MOST_FRAMES} are allowed")
    q = coefficients.decode(data[HEADER.size :], frames)
    root = rotation.from_rotation_vector(np.array([[x, y, z]]) * REFERENCE_UNIT)
    reference = np.concatenate([root, track.reference_rotations])
    return MotionBlock(frames, q, q * track.steps(step, frames)[:, None, None], reference)
