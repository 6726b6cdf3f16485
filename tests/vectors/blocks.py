"""Motion blocks, valid and invalid (`blocks.json`)."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec.block_encoder import MEAN_ERROR_REFINEMENT, BlockEncoder
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MotionTrack, plan_motion_track
from bunraku.codec.prior import IntArray, load_shipped_prior
from bunraku.motion import rotation
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_COUNT, Motion, standard_figure
from tests.vectors.range_encoding import encode_bits


def to_base64(data: bytes) -> str:
    """Return bytes in base64."""
    return base64.b64encode(data).decode()


def random_motion(seconds: float, fps: float, seed: int) -> Motion:
    """Return smooth movement of every channel, with whole turns of the root."""
    random = np.random.default_rng(seed)
    frames = round(seconds * fps)
    t = np.arange(frames)[:, None, None] / fps
    rate = random.uniform(0.2, 2.5, (4, JOINT_COUNT + 1, 3))
    phase = random.uniform(0, 2 * np.pi, rate.shape)
    size = random.normal(0, 0.25, rate.shape) / rate
    tracks = sum(size[i] * np.sin(2 * np.pi * rate[i] * t + phase[i]) for i in range(4))
    assert isinstance(tracks, np.ndarray)
    tracks[:, 1, 1] += 4.0 * t[:, 0, 0]
    root = tracks[:, 0] + [0.3, 0.9, -2.0]
    return Motion(standard_figure(), fps, root, rotation.from_rotation_vector(tracks[:, 1:]))


def random_coefficients(random: np.random.Generator, count: int, max_magnitude: int) -> IntArray:
    """Return sparse coefficients (19, 3, `count`) of all magnitudes up to `max_magnitude`."""
    size = np.floor(2.0 ** random.uniform(0, np.log2(max_magnitude + 1), (CHANNEL_COUNT, 3, count))).astype(np.int64)
    is_nonzero = random.random(size.shape) < random.choice([0.05, 0.5, 0.95], (CHANNEL_COUNT, 1, 1))
    quantised: IntArray = size * is_nonzero * random.choice([-1, 1], size.shape)
    return quantised


def encode_header(numbers: list[tuple[int, int]], frames: int | None = None, scene: bool = False) -> bytes:
    """Encode a block header of `frames` frames (None: the nominal number) and any `numbers` (value, bits) after them.

    A `scene` header has no bit for its channels. All bits decoded after the header are ones.
    """
    explicit = [] if frames is None else [(16384, bool(frames >> i & 1)) for i in range(9, -1, -1)]
    bits = [(32440, frames is None), *explicit, *([] if scene else [(512, False)])]
    bits += [(16384, bool(value >> i & 1)) for value, n in numbers for i in range(n - 1, -1, -1)]
    return encode_bits(bits)


def block_vector(track: MotionTrack, number: int, data: bytes) -> dict[str, Any]:
    """Return a valid block of track `number` with its decoded header, coefficients and poses."""
    header, q = coefficients.decode_coefficients(load_shipped_prior(), data, track.block_frames, track.fps)
    block, poses = decode_motion_block(track, data), []
    for instant in (0.0, header.frames / 3 - 0.5, header.frames - 1.0, header.frames - 0.5):
        root, rotations = block.pose_at(instant)
        poses.append({"instant": instant, "root": root[0].tolist(), "rotations": rotations[0].ravel().tolist()})
    return {
        "track": number,
        "block": to_base64(data),
        "frames": header.frames,
        "step": header.step,
        "heading": header.heading,
        "q": q.ravel().tolist(),
        "poses": poses,
    }


def track_vector(track: MotionTrack) -> dict[str, Any]:
    """Return a track's fields in a Description, and the values that follow from its skeleton description."""
    return {
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "first_frames": track.first_frames,
        "dancer": to_base64(track.skeleton.pack()),
        "offsets": track.figure.offsets.ravel().tolist(),
        "tips": track.figure.tips.ravel().tolist(),
        "reference": track.reference_rotations().ravel().tolist(),
        "weights": track.weights.tolist(),
    }


def make_vectors() -> dict[str, Any]:
    """Return tracks, blocks of several lengths and steps with coefficients and poses, and invalid blocks."""
    motion, fast_motion = random_motion(2.6, 30.0, 7), random_motion(1.1, 59.94, 8)
    even = replace(plan_motion_track(motion), block_frames=30, first_frames=30)
    quick = plan_motion_track(fast_motion, 0.36, 0.1, mean_error_mm=2.0)
    still_rotations = np.repeat(motion.rotations[3:4], 20, axis=0)
    still_motion = Motion(standard_figure(), 24.0, motion.root[:20] * 0, still_rotations)
    still = plan_motion_track(still_motion)
    tracks = [even, quick, still]
    valid = []
    goals: tuple[tuple[int, Motion, int, int, Literal["first", "mean"]], ...] = (
        (0, motion, 0, 90, "mean"),
        (0, motion, 0, 190, "mean"),
        (0, motion, 1, 130, "first"),
        (0, motion, 2, 160, "mean"),
        (1, fast_motion, 0, 60, "first"),
        (1, fast_motion, 1, 150, "mean"),
        (1, fast_motion, 2, 110, "mean"),
        (2, still_motion, 0, 120, "mean"),
    )
    for number, source, index, step, goal in goals:
        coded = BlockEncoder(tracks[number], source, load_shipped_prior()).encode_block(
            index, step, MEAN_ERROR_REFINEMENT if goal == "mean" else None
        )
        valid.append(block_vector(tracks[number], number, coded.data))
    random = np.random.default_rng(9)
    for number, frames, step, heading, count, max_magnitude in (
        (0, 30, 0, 0, 0, 1),
        (0, 1, 0, 31, 1, 12),
        (1, 2, 255, -32, 2, 3),
        (0, 31, 7, -2, 31, 1 << 12),
        (0, 30, 0, 2, 24, 1 << 20),
        (1, 240, 77, 16, 70, 60),
        (2, 512, 100, -1, 40, 1 << 8),
    ):
        track = tracks[number]
        q = random_coefficients(random, count, max_magnitude)
        data = coefficients.encode_coefficients(
            load_shipped_prior(), BlockHeader(frames, step, heading), q, track.block_frames, track.fps
        )
        valid.append(block_vector(track, number, data))
    rest = [(9, 8), (32, 6)]
    invalid = {
        "empty: more frequencies than frames": b"",
        "no frames": encode_header(rest, 0),
        "too many frames": encode_header([*rest, (4, 10)], 513),
        "more frequencies than frames": encode_header([*rest, (5, 3)], 4),
        "more frequencies than the usual frames": encode_header([*rest, (31, 5)]),
        "an escape too long": encode_header([*rest, (1, 5)]) + bytes(30),
        "too large": base64.b64decode(valid[-1]["block"]) + bytes(65_536),
    }
    return {
        "tracks": [track_vector(track) for track in tracks],
        "valid": valid,
        "invalid": [{"why": why, "block": to_base64(data)} for why, data in invalid.items()],
    }
