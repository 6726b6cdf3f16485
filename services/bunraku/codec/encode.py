"""Frames of a motion to blocks at several rates, each within its error (SPEC.md, Motion block)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
from typing import Any, Literal

import numpy as np

from bunraku.codec.decode import decode_block
from bunraku.codec.prior import Prior, shipped
from bunraku.codec.search import BlockEncoder, Coded
from bunraku.codec.track import MotionTrack, describe_track, plan
from bunraku.motion import rotation
from bunraku.motion.place import MIDDLE, Place
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, Motion, front, points, standard_figure

LADDER: tuple[float, ...] = (60.0, 20.0, 8.0, 3.0, 0.5)
"""Largest error of each rate at any point and frame, mm, from the lowest rate to the highest: about 1 kbit/s to what
cannot be told from the source."""

_MEAN_OF_MOST = 0.3
"""A mean error is about this share of the largest."""

Grade = Literal["live", "best"]


@dataclass(frozen=True, slots=True)
class Rate:
    """One encoding of a whole motion: its blocks, and what they cost and keep.

    `kbps` counts the blocks' bytes over the duration; `mean` and `most` are errors in mm over 18 joints and 5 tips as
    decoded; `bound` is what no point of any block exceeds.
    """

    blocks: list[bytes]
    kbps: float
    mean: float
    most: float
    bound: float


Spread = Callable[[Callable[[float], Rate], Iterable[float]], Iterable[Rate]]
"""What `map` does."""


@dataclass(frozen=True, slots=True)
class EncodedMotion:
    """A motion at every rate, lowest first, upon one track; `front` is where it faces (`skeleton.front`), `place` where
    on the stage it is danced."""

    track: MotionTrack
    rates: list[Rate]
    front: float
    place: Place = MIDDLE

    def describe(self) -> dict[str, Any]:
        """What a Description says of this motion (SPEC.md, Track `motion`)."""
        rates = [{"kbps": round(r.kbps, 3), "mean": round(r.mean, 3), "max": r.bound} for r in self.rates]
        said = describe_track(self.track, rates) | {"front": round(self.front, 3)}
        return said if self.place == MIDDLE else said | {"place": list(self.place)}


def encode_motion(
    motion: Motion,
    block_seconds: float = 1.0,
    ladder: tuple[float, ...] = LADDER,
    grade: Grade = "best",
    first_seconds: float | None = None,
    prior: Prior | None = None,
    progress: Callable[[float], None] = lambda _: None,
    spread: Spread = map,
) -> EncodedMotion:
    """Encode `motion` in independent blocks at every largest error of `ladder` (mm), and check each by decoding it.

    `progress` is told the share done, 0..1. `spread` makes the rates: `map`, or a pool's, as the compiled code lets
    other threads run; `progress` is then called from them. Raises ValueError for a motion that no step can hold to its
    error.
    """
    track = plan(motion, block_seconds, first_seconds, min(ladder) * _MEAN_OF_MOST)
    encoder = BlockEncoder(track, motion, prior or shipped())
    done = count(1)

    def encode(bound: float) -> Rate:
        coded: list[Coded] = []
        for index in range(track.blocks):
            coded.append(encoder.bounded(index, bound, grade, coded[-1].step if coded else None))
            progress(next(done) / (track.blocks * len(ladder)))
        return measure(track, motion, [block.data for block in coded], bound, prior)

    # the finest take the longest
    rates = list(spread(encode, ladder[::-1]))[::-1]
    return EncodedMotion(track, rates, front(motion))


def encode_mean(
    motion: Motion, mean: float, block_seconds: float = 1.0, prior: Prior | None = None
) -> tuple[MotionTrack, Rate]:
    """Encode `motion` so that its mean error comes up to `mean` mm and not above, allotted among its blocks."""
    track = plan(motion, block_seconds, mean=mean)
    encoder = BlockEncoder(track, motion, prior or shipped())
    blocks = encoder.averaged(mean)
    return track, measure(track, motion, [block.data for block in blocks], np.inf, prior)


def warm() -> None:
    """Load or compile what encoding needs, and decoding."""
    figure = standard_figure()
    still = Motion(figure, 30.0, np.zeros((2, 3)), np.tile(rotation.IDENTITY, (2, JOINT_COUNT, 1)))
    encode_motion(still, ladder=(10.0,))


def measure(track: MotionTrack, motion: Motion, blocks: list[bytes], bound: float, prior: Prior | None = None) -> Rate:
    """The rate that `blocks` make, by decoding them; raises ValueError where an error is above `bound` mm."""
    errors = [_errors(track, motion, index, block, prior) for index, block in enumerate(blocks)]
    error = np.concatenate(errors)
    if error.max() > bound:
        raise ValueError(f"a block is {error.max():.3f} mm off where {bound} mm is the most")
    kbps = sum(map(len, blocks)) * 8e-3 / motion.duration
    return Rate(blocks, kbps, float(error.mean()), float(error.max()), float(bound))


def _errors(track: MotionTrack, motion: Motion, index: int, block: bytes, prior: Prior | None) -> Array:
    """How far each point (n, 23) of a block is off when decoded, mm."""
    start, frames = track.first_frame(index), track.frames_in(index)
    part = slice(start, start + frames)
    truth = points(motion.figure, motion.root[part], motion.rotations[part])
    decoded = points(track.figure, *decode_block(track, block, prior).at(np.arange(frames, dtype=np.float64)))
    error: Array = np.linalg.norm(decoded - truth, axis=-1) * 1e3
    return error
