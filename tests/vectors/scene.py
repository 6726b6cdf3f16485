"""Blocks of cameras and lights, valid and invalid (`scene.json`)."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.prior import IntArray, load_shipped_prior
from bunraku.codec.scene import SCENE_CHANNEL_COUNT, SceneSamples, SceneTrack
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import encode_scene
from tests.vectors.blocks import encode_header, to_base64


def sample_camera(seconds: float, fps: float) -> SceneSamples:
    """Return a camera that moves about the performer at about 3 m and zooms."""
    t = np.arange(round(seconds * fps)) * (2 * np.pi / fps)
    angle, distance = 0.5 * np.sin(t / 11), 3.2 + 0.6 * np.sin(t / 7 + 1)
    position = [distance * np.sin(angle), 1.4 + 0.3 * np.sin(t / 9), distance * np.cos(angle)]
    gaze = [0.4 * np.sin(t / 5), 1.0 + 0.1 * np.sin(t / 2.3), 0.3 * np.cos(t / 6)]
    return SceneSamples("camera", fps, np.stack([*position, *gaze, np.radians(40 + 8 * np.sin(t / 8))], axis=1))


def sample_light(seconds: float, fps: float) -> SceneSamples:
    """Return a swaying light that changes colour and is dimmed to zero and back; full intensity 800."""
    t = np.arange(round(seconds * fps)) * (2 * np.pi / fps)
    position = [2 + 0.2 * np.sin(t / 3), 4 + 0.1 * np.cos(t / 3), 1 + 0 * t]
    blue = 0.5 + 0.5 * np.sin(t / 4)
    intensity = 800 * np.maximum(0, np.cos(t / 5)) ** 2
    return SceneSamples("light", fps, np.stack([*position, 1 - 0.6 * blue, 0.8 - 0.2 * blue, blue, intensity], axis=1))


def block_vector(track: SceneTrack, number: int, data: bytes) -> dict[str, Any]:
    """Return a valid block of track `number` with its decoded header, coefficients and values."""
    header, q = coefficients.decode_coefficients(
        load_shipped_prior(), data, track.block_frames, track.fps, SCENE_LAYOUT
    )
    instants = (0.0, header.frames / 3 - 0.5, header.frames - 1.0, header.frames - 0.5)
    values = decode_scene_block(track, data).values_at(np.array(instants))
    return {
        "track": number,
        "block": to_base64(data),
        "frames": header.frames,
        "step": header.step,
        "q": q.ravel().tolist(),
        "values": [{"instant": t, "numbers": row.tolist()} for t, row in zip(instants, values, strict=True)],
    }


def _random_coefficients(random: np.random.Generator, count: int, max_magnitude: int) -> IntArray:
    size = np.floor(2.0 ** random.uniform(0, np.log2(max_magnitude + 1), (SCENE_CHANNEL_COUNT, 3, count))).astype(
        np.int64
    )
    quantised: IntArray = size * random.choice([-1, 0, 1], size.shape)
    quantised[2, 1:] = 0
    return quantised


def make_vectors() -> dict[str, Any]:
    """Return tracks, blocks of several lengths and steps, and invalid blocks of the first track."""
    still = SceneSamples("camera", 24.0, np.repeat(sample_camera(0.1, 24.0).values[:1], 30, axis=0))
    scenes = (
        encode_scene(sample_camera(2.6, 30.0), error_bounds_mm=(20.0, 1.0)),
        encode_scene(sample_light(2.6, 59.94), 0.43, error_bounds_mm=(10.0,), first_seconds=0.1),
        encode_scene(still, error_bounds_mm=(1.0,)),
    )
    tracks = [scene.track for scene in scenes]
    valid = [
        block_vector(tracks[number], number, data)
        for number, scene in enumerate(scenes)
        for rate in scene.ladder
        for data in rate.blocks
    ]
    random = np.random.default_rng(10)
    for number, frames, step, count, max_magnitude in (
        (0, 1, 255, 1, 3),
        (0, 30, 7, 30, 1 << 12),
        (1, 30, 60, 30, 1 << 16),
        (0, 512, 100, 40, 1 << 8),
        (1, 31, 0, 9, 1 << 20),
        (0, 60, 255, 60, 1 << 19),
    ):
        track = tracks[number]
        q = _random_coefficients(random, count, max_magnitude)
        data = coefficients.encode_coefficients(
            load_shipped_prior(), BlockHeader(frames, step, 0), q, track.block_frames, track.fps, SCENE_LAYOUT
        )
        valid.append(block_vector(track, number, data))
    nominal = tracks[0].block_frames
    invalid = {
        "no frames": encode_header([(9, 8)], 0, scene=True),
        "too many frames": encode_header([(9, 8), (4, 10)], 513, scene=True),
        "more frequencies than frames": encode_header([(9, 8), (5, 3)], 4, scene=True),
        "more frequencies than the usual frames": encode_header(
            [(9, 8), (nominal + 1, nominal.bit_length())], scene=True
        ),
        "an escape too long": encode_header([(9, 8), (1, nominal.bit_length())], scene=True) + bytes(30),
        "too large": base64.b64decode(valid[-1]["block"]) + bytes(65_536),
    }
    return {
        "tracks": [scene.describe() for scene in scenes],
        "valid": valid,
        "invalid": [{"why": why, "block": to_base64(data)} for why, data in invalid.items()],
    }
