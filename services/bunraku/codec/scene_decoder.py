"""Decoder of scene blocks: bytes to the values of a camera or light at any instant (proto/codec.md, 2.14)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import IntArray, Prior, load_shipped_prior
from bunraku.codec.scene import SceneTrack
from bunraku.motion.rotation import Array


@dataclass(frozen=True, slots=True)
class SceneBlock:
    """A decoded block of `track`: quantised coefficients `q` (3, 3, K) and their `values` (3, 3, K), metres."""

    track: SceneTrack
    frames: int
    q: IntArray
    values: Array

    def values_at(self, instants: Array | float) -> Array:
        """Return the seven values (m, 7) at `instants` (m,), in frames from the block's first.

        Instants are any real in -1/2 .. frames - 1/2.
        """
        instants = np.atleast_1d(np.asarray(instants, dtype=np.float64))
        return self.track.from_channels(transform.inverse_dct(self.values, self.frames, instants))


def decode_scene_block(track: SceneTrack, data: bytes, prior: Prior | None = None) -> SceneBlock:
    """Decode one block of `track`. Raises `DamagedBlock`.

    `prior` must be the one with which the block was encoded; the default is the shipped prior.
    """
    header, q = coefficients.decode_coefficients(
        prior or load_shipped_prior(), data, track.block_frames, track.fps, SCENE_LAYOUT
    )
    return SceneBlock(track, header.frames, q, reconstruct(q) * step_size(header.step, header.frames))
