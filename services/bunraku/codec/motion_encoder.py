"""Frames of a motion to blocks at several rates, each within its error (SPEC.md, Motion block)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
from typing import Any, Literal

import numpy as np

from bunraku.codec.block_encoder import BlockEncoder, EncodedBlock
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MotionTrack, describe_motion_track, plan_motion_track
from bunraku.codec.prior import Prior, load_shipped_prior
from bunraku.motion import rotation
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, Motion, joint_and_tip_positions, mean_facing, standard_figure

ERROR_BOUNDS_MM: tuple[float, ...] = (60.0, 20.0, 8.0, 3.0, 0.5)
"""Largest error of each rate at any point and frame, mm, from the lowest rate to the highest: about 1 kbit/s to what
cannot be told from the source."""

_MEAN_TO_MAX_ERROR_RATIO = 0.3
"""A mean error is about this share of the largest."""

EncodingGrade = Literal["live", "best"]


@dataclass(frozen=True, slots=True)
class BitrateLevel:
    """One encoding of a whole motion: its blocks, and what they cost and keep.

    `kbps` counts the blocks' bytes over the duration; `mean` and `most` are errors in mm over 18 joints and 5 tips as
    decoded; `bound` is what no point of any block exceeds.
    """

    blocks: list[bytes]
    kbps: float
    mean_error_mm: float
    max_error_mm: float
    error_bound_mm: float


LevelMapper = Callable[[Callable[[float], BitrateLevel], Iterable[float]], Iterable[BitrateLevel]]
"""What `map` does."""


@dataclass(frozen=True, slots=True)
class EncodedMotion:
    """A motion at every rate, lowest first, upon one track; `front` is where it faces (`skeleton.front`), `place` where
    on the stage it is danced."""

    track: MotionTrack
    ladder: list[BitrateLevel]
    front: float
    placement: Placement = STAGE_CENTRE

    def describe(self) -> dict[str, Any]:
        """What a Description says of this motion (SPEC.md, Track `motion`)."""
        rates = [
            {"kbps": round(r.kbps, 3), "mean": round(r.mean_error_mm, 3), "max": r.error_bound_mm} for r in self.ladder
        ]
        said = describe_motion_track(self.track, rates) | {"front": round(self.front, 3)}
        return said if self.placement == STAGE_CENTRE else said | {"place": list(self.placement)}


def encode_motion(
    motion: Motion,
    block_seconds: float = 1.0,
    error_bounds_mm: tuple[float, ...] = ERROR_BOUNDS_MM,
    grade: EncodingGrade = "best",
    first_seconds: float | None = None,
    prior: Prior | None = None,
    on_progress: Callable[[float], None] = lambda _: None,
    map_levels: LevelMapper = map,
) -> EncodedMotion:
    """Encode `motion` in independent blocks at every largest error of `ladder` (mm), and check each by decoding it.

    `progress` is told the share done, 0..1. `spread` makes the rates: `map`, or a pool's, as the compiled code lets
    other threads run; `progress` is then called from them. Raises ValueError for a motion that no step can hold to its
    error.
    """
    track = plan_motion_track(motion, block_seconds, first_seconds, min(error_bounds_mm) * _MEAN_TO_MAX_ERROR_RATIO)
    encoder = BlockEncoder(track, motion, prior or load_shipped_prior())
    done = count(1)

    def encode(bound: float) -> BitrateLevel:
        coded: list[EncodedBlock] = []
        for index in range(track.block_count):
            coded.append(encoder.encode_within_bound(index, bound, grade, coded[-1].step if coded else None))
            on_progress(next(done) / (track.block_count * len(error_bounds_mm)))
        return measure_level(track, motion, [block.data for block in coded], bound, prior)

    # the finest take the longest
    rates = list(map_levels(encode, error_bounds_mm[::-1]))[::-1]
    return EncodedMotion(track, rates, mean_facing(motion))


def encode_motion_to_mean_error(
    motion: Motion, mean_error_mm: float, block_seconds: float = 1.0, prior: Prior | None = None
) -> tuple[MotionTrack, BitrateLevel]:
    """Encode `motion` so that its mean error comes up to `mean` mm and not above, allotted among its blocks."""
    track = plan_motion_track(motion, block_seconds, mean_error_mm=mean_error_mm)
    encoder = BlockEncoder(track, motion, prior or load_shipped_prior())
    blocks = encoder.encode_to_mean_error(mean_error_mm)
    return track, measure_level(track, motion, [block.data for block in blocks], np.inf, prior)


def warm_up() -> None:
    """Load or compile what encoding needs, and decoding."""
    figure = standard_figure()
    still = Motion(figure, 30.0, np.zeros((2, 3)), np.tile(rotation.IDENTITY, (2, JOINT_COUNT, 1)))
    encode_motion(still, error_bounds_mm=(10.0,))


def measure_level(
    track: MotionTrack, motion: Motion, blocks: list[bytes], error_bound_mm: float, prior: Prior | None = None
) -> BitrateLevel:
    """The rate that `blocks` make, by decoding them; raises ValueError where an error is above `bound` mm."""
    errors = [_measure_block_errors(track, motion, index, block, prior) for index, block in enumerate(blocks)]
    error = np.concatenate(errors)
    if error.max() > error_bound_mm:
        raise ValueError(f"a block is {error.max():.3f} mm off where {error_bound_mm} mm is the most")
    kbps = sum(map(len, blocks)) * 8e-3 / motion.duration
    return BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), float(error_bound_mm))


def _measure_block_errors(track: MotionTrack, motion: Motion, index: int, block: bytes, prior: Prior | None) -> Array:
    """How far each point (n, 23) of a block is off when decoded, mm."""
    start, frames = track.first_frame(index), track.frames_in(index)
    part = slice(start, start + frames)
    truth = joint_and_tip_positions(motion.figure, motion.root[part], motion.rotations[part])
    decoded = joint_and_tip_positions(
        track.figure, *decode_motion_block(track, block, prior).pose_at(np.arange(frames, dtype=np.float64))
    )
    error: Array = np.linalg.norm(decoded - truth, axis=-1) * 1e3
    return error
