"""Frames of a motion to blocks at several rates (SPEC.md, Motion block)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.decode import FORMAT, HEADER, decode_block
from bunraku.codec.track import REFERENCE_UNIT, MotionTrack, describe_track, plan
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Motion, front, points

STEPS: tuple[int, ...] = (30, 24, 17, 9)
"""Step index of each rate, from the lowest rate to the highest."""

_ROUNDING = np.array([0.5, 0.5, 0.42])
"""Where rounding up begins is past the middle for the joints: a zero more costs less than the error it makes."""


@dataclass(frozen=True, slots=True)
class Rate:
    """One encoding of a whole motion: its blocks, and what they cost and keep.

    `kbps` counts the blocks' bytes over the duration; `mean` and `most` are errors in mm over 18 joints and 5 tips.
    """

    blocks: list[bytes]
    kbps: float
    mean: float
    most: float


@dataclass(frozen=True, slots=True)
class EncodedMotion:
    """A motion at every rate, lowest first, upon one track; `front` is where it faces (`skeleton.front`)."""

    track: MotionTrack
    rates: list[Rate]
    front: float

    def describe(self) -> dict[str, Any]:
        """What a Description says of this motion (SPEC.md, Track `motion`)."""
        rates = [{"kbps": round(r.kbps, 3), "mean": round(r.mean, 3), "max": round(r.most, 3)} for r in self.rates]
        return describe_track(self.track, rates) | {"front": round(self.front, 3)}


def encode_block(track: MotionTrack, root: Array, rotations: Array, step: int) -> bytes:
    """One block of the frames `root` (n, 3) and `rotations` (n, 18, 4), n <= 1,000, at step index `step`."""
    frames = len(root)
    middle = rotation.to_rotation_vector(rotations[frames // 2, 0])
    centre = np.clip(np.round(middle / REFERENCE_UNIT), -127, 127)
    reference = np.concatenate(
        [rotation.from_rotation_vector(centre * REFERENCE_UNIT)[None], track.reference_rotations]
    )
    relative = rotation.multiply(np.broadcast_to(rotation.conjugate(reference), rotations.shape), rotations)
    vectors = rotation.continuous(rotation.to_rotation_vector(relative))
    values = transform.forward(np.concatenate([root[:, None], vectors], axis=1))
    scaled = values / track.steps(step, frames)[:, None, None]
    rounding = _ROUNDING[np.minimum(np.arange(len(scaled)), 2)][:, None, None]
    q = (np.sign(scaled) * np.floor(np.abs(scaled) + rounding)).astype(np.int64)
    return HEADER.pack(FORMAT, step, frames, *(int(c) for c in centre)) + coefficients.encode(q)


def encode_motion(motion: Motion, block_seconds: float = 1.0, steps: tuple[int, ...] = STEPS) -> EncodedMotion:
    """Encode `motion` at every step of `steps` in independent blocks, and measure each rate by decoding it."""
    track, motion = plan(motion, block_seconds)
    truth = points(motion.figure, motion.root, motion.rotations)
    bounds = [(i * track.block_frames, i * track.block_frames + track.frames_in(i)) for i in range(track.blocks)]
    rates = []
    for step in steps:
        blocks = [encode_block(track, motion.root[a:b], motion.rotations[a:b], step) for a, b in bounds]
        error = np.concatenate(
            [
                np.linalg.norm(
                    points(track.figure, *decode_block(track, block).at(np.arange(b - a, dtype=np.float64)))
                    - truth[a:b],
                    axis=-1,
                )
                for block, (a, b) in zip(blocks, bounds, strict=True)
            ]
        )
        kbps = sum(map(len, blocks)) * 8e-3 / motion.duration
        rates.append(Rate(blocks, kbps, float(error.mean()) * 1e3, float(error.max()) * 1e3))
    return EncodedMotion(track, rates, front(motion))
