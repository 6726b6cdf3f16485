"""Encodings of clips for error goals, and the bytes that a viewer receives for them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM, encode_motion, encode_motion_to_mean_error
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.prior import Prior
from bunraku.ingest.jobs.encoding import FIRST_BLOCK_S
from bunraku.motion.skeleton import Motion
from bunraku.wire.messages import Data

ErrorGoal = tuple[str, float]
"""A mean or maximum error: `mean` or `max`, and mm."""


class GoalEncoding(NamedTuple):
    """What a viewer receives for a motion at an error goal: its bitrate, and the size of each block's message."""

    kbps: float
    message_bytes: list[int]


def encode_to_goal(motion: Motion, goal: ErrorGoal, prior: Prior, block_seconds: float) -> GoalEncoding:
    """Encode a motion for one goal, in blocks of one length."""
    kind, error = goal
    if kind == "mean":
        track, level = encode_motion_to_mean_error(motion, error, block_seconds, prior)
    else:
        encoded = encode_motion(motion, block_seconds, (error,), prior=prior)
        track, level = encoded.track, encoded.ladder[0]
    return _received(motion, track, level.blocks)


def encode_as_served(motion: Motion, prior: Prior) -> dict[float, GoalEncoding]:
    """Encode a motion as an upload is: one description and one division into blocks for all levels of the ladder.

    Returns:
        What a viewer receives that watches only one level, by the error bound of the level.
    """
    encoded = encode_motion(motion, first_seconds=FIRST_BLOCK_S, prior=prior)
    levels = zip(ERROR_BOUNDS_MM, encoded.ladder, strict=True)
    return {bound: _received(motion, encoded.track, level.blocks) for bound, level in levels}


def geometric_mean(values: list[float]) -> float:
    """Return the geometric mean of positive values."""
    return float(np.exp(np.mean(np.log(values))))


def summarise_tails(encodings: list[GoalEncoding]) -> dict[str, float]:
    """Return the bitrate of the worst clip, and p95 of the bytes of a block's message over all clips."""
    sizes = [size for encoding in encodings for size in encoding.message_bytes]
    return {
        "kbps_worst_clip": max(encoding.kbps for encoding in encodings),
        "block_bytes_p95": float(np.percentile(sizes, 95)),
    }


def _received(motion: Motion, track: MotionTrack, blocks: list[bytes]) -> GoalEncoding:
    """Return what a viewer receives: blocks in Data messages and WebSocket frames, and the skeleton description."""
    packets = [len(Data(0, 0, index, block).pack()) for index, block in enumerate(blocks)]
    framed = [size + (2 if size < 126 else 4) for size in packets]
    total = sum(framed) + len(track.skeleton.pack())
    return GoalEncoding(total * 8e-3 / motion.duration, framed)
