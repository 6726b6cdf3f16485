"""A block of a camera or a light to its numbers at any instant (SPEC.md, Tracks `camera` and `light`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.coefficients import SCENE_CHANNEL_COUNT
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import IntArray, Prior, load_shipped_prior
from bunraku.codec.scene import SceneTrack
from bunraku.motion.rotation import Array


@dataclass(frozen=True, slots=True)
class SceneBlock:
    """A decoded block of `track`: `frames` frames, quantised `q` (3, 3, K) and their values (3, 3, K), metres."""

    track: SceneTrack
    frames: int
    q: IntArray
    values: Array

    def values_at(self, instants: Array | float) -> Array:
        """The seven numbers (m, 7) at `instants` (m,), in frames from the block's first; any real in -1/2 .. frames -
        1/2."""
        instants = np.atleast_1d(np.asarray(instants, dtype=np.float64))
        return self.track.from_channels(transform.inverse_dct(self.values, self.frames, instants))


def decode_scene_block(track: SceneTrack, data: bytes, prior: Prior | None = None) -> SceneBlock:
    """Decode one block of `track`; raises `DamagedBlock` on what cannot be one. `prior` as in `decode_block`."""
    head, q = coefficients.decode_coefficients(
        prior or load_shipped_prior(), data, track.block_frames, track.fps, SCENE_CHANNEL_COUNT
    )
    return SceneBlock(track, head.frames, q, reconstruct(q) * step_size(head.step, head.frames))
