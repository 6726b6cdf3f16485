"""Encoder of scenes: a camera or light at several bitrate levels (proto/codec.md, 2.14)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.motion_encoder import BitrateLevel
from bunraku.codec.prior import Prior, load_shipped_prior
from bunraku.codec.scene import SceneSamples, SceneTrack, describe_scene_track, plan_scene_track
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.step_search import encode_channels
from bunraku.codec.timing import plan_timing
from bunraku.motion.rotation import Array

SCENE_ERROR_BOUNDS_MM: tuple[float, ...] = (40.0, 20.0, 10.0, 4.0, 1.0)
"""Largest weighted error of each bitrate level at any frame, lowest level first; as many levels as a motion has."""


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
    candidates = [
        data
        for data in encode_channels(truth, error_bound_mm, track, SCENE_LAYOUT, prior)
        if measure_scene_error(track, scene, index, data, prior).max() <= error_bound_mm
    ]
    if not candidates:
        raise ValueError(
            f"Block {index} of the {track.kind} cannot be encoded within {error_bound_mm} mm, even at the finest step."
        )
    return min(candidates, key=len)
