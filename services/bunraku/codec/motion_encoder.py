"""Encoder of motions: blocks at several bitrate levels, each within its error bound (proto/codec.md, 2.8 and 2.9)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np

from bunraku.codec.block_encoder import BlockEncoder, EncodedBlock
from bunraku.codec.block_encoder import EncodingGrade as EncodingGrade  # part of the signature of `encode_motion`
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import MotionTrack, describe_motion_track, plan_motion_track
from bunraku.codec.prior import Prior, load_shipped_prior
from bunraku.motion import rotation
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, Motion, joint_and_tip_positions, mean_facing, standard_figure

ERROR_BOUNDS_MM: tuple[float, ...] = (60.0, 20.0, 8.0, 3.0, 0.5)
"""Largest error of each bitrate level at any point and frame, lowest level first.

They range from about 1 kbit/s to a quality that is indistinguishable from the source.
"""

_MEAN_TO_MAX_ERROR_RATIO = 0.3
"""Typical mean error as a share of the largest."""
_GRID_ERROR_MM = 0.5
"""Largest error below which the grid of the figure gets finer: at this bound, 0.2 mm costs less than 0.1 mm.

Only refined blocks correct errors of so coarse a grid.
"""


@dataclass(frozen=True, slots=True)
class BitrateLevel:
    """One encoding of a whole track.

    `kbps` is the bitrate of the blocks over the duration. Errors are those of the decoded blocks: of a motion at
    18 joints and 5 tips, of a scene the weighted errors of its channels. No block exceeds `error_bound_mm`.
    """

    blocks: list[bytes]
    kbps: float
    mean_error_mm: float
    max_error_mm: float
    error_bound_mm: float

    def describe(self) -> dict[str, float]:
        """Return the entry of a track's `rates` in a Description."""
        return {"kbps": round(self.kbps, 3), "mean": round(self.mean_error_mm, 3), "max": self.error_bound_mm}


LevelMapper = Callable[[Callable[[float], BitrateLevel], Iterable[float]], Iterable[BitrateLevel]]
"""A function like `map`, for example the `map` of a thread pool."""


@dataclass(frozen=True, slots=True)
class EncodedMotion:
    """A motion at every bitrate level, lowest first.

    `front` is the direction that it faces (`skeleton.mean_facing`), `placement` its place on the stage.
    """

    track: MotionTrack
    ladder: list[BitrateLevel]
    front: float
    placement: Placement = STAGE_CENTRE

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks` (proto/messages.md, 3.2)."""
        description = describe_motion_track(self.track, [level.describe() for level in self.ladder])
        description["front"] = round(self.front, 3)
        if self.placement != STAGE_CENTRE:
            description["place"] = list(self.placement)
        return description


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
    """Encode a motion in independent blocks, and check each block by decoding it.

    Args:
        motion: The motion.
        block_seconds: Approximate length of the blocks.
        error_bounds_mm: Largest error of each bitrate level.
        grade: Effort of the search.
        first_seconds: Length of the first block, if it differs.
        prior: Prior of the context model; the default is the shipped one.
        on_progress: Receives the share that is done, 0..1, from the threads of `map_levels`.
        map_levels: Encodes the levels: `map`, or that of a thread pool. The compiled code releases the GIL.

    Raises:
        ValueError: The finest step does not meet a bound.
    """
    finest = min(error_bounds_mm)
    grid_error_mm = finest * _MEAN_TO_MAX_ERROR_RATIO
    if grade == "best":
        grid_error_mm = max(grid_error_mm, min(finest, _GRID_ERROR_MM))
    track = plan_motion_track(motion, block_seconds, first_seconds, grid_error_mm)
    encoder = BlockEncoder(track, motion, prior or load_shipped_prior())
    finished = count(1)

    def encode_level(error_bound_mm: float) -> BitrateLevel:
        blocks: list[EncodedBlock] = []
        for index in range(track.block_count):
            initial_step = blocks[-1].step if blocks else None
            blocks.append(encoder.encode_within_bound(index, error_bound_mm, grade, initial_step))
            on_progress(next(finished) / (track.block_count * len(error_bounds_mm)))
        return measure_level(track, motion, [block.data for block in blocks], error_bound_mm, prior)

    # the highest levels take longest, so start with them
    ladder = list(map_levels(encode_level, error_bounds_mm[::-1]))[::-1]
    return EncodedMotion(track, ladder, mean_facing(motion))


def encode_motion_to_mean_error(
    motion: Motion, mean_error_mm: float, block_seconds: float = 1.0, prior: Prior | None = None
) -> tuple[MotionTrack, BitrateLevel]:
    """Encode a motion with a mean error of at most, and close to, `mean_error_mm`, allocated among its blocks."""
    track = plan_motion_track(motion, block_seconds, mean_error_mm=mean_error_mm)
    encoder = BlockEncoder(track, motion, prior or load_shipped_prior())
    blocks = encoder.encode_to_mean_error(mean_error_mm)
    return track, measure_level(track, motion, [block.data for block in blocks], np.inf, prior)


def warm_up() -> None:
    """Load the code of encoder and decoder, or compile it if it is not cached."""
    figure = standard_figure()
    still = Motion(figure, 30.0, np.zeros((2, 3)), np.tile(rotation.IDENTITY, (2, JOINT_COUNT, 1)))
    encode_motion(still, error_bounds_mm=(10.0,))


def measure_level(
    track: MotionTrack, motion: Motion, blocks: list[bytes], error_bound_mm: float, prior: Prior | None = None
) -> BitrateLevel:
    """Return the bitrate level of `blocks`, measured by decoding them. Raises ValueError if one exceeds the bound."""
    errors = [_measure_block_errors(track, motion, index, block, prior) for index, block in enumerate(blocks)]
    error = np.concatenate(errors)
    if error.max() > error_bound_mm:
        raise ValueError(f"A decoded block has an error of {error.max():.3f} mm, the bound is {error_bound_mm} mm.")
    kbps = sum(map(len, blocks)) * 8e-3 / motion.duration
    return BitrateLevel(blocks, kbps, float(error.mean()), float(error.max()), float(error_bound_mm))


def _measure_block_errors(track: MotionTrack, motion: Motion, index: int, block: bytes, prior: Prior | None) -> Array:
    """Return the error of each point (n, 23) of a decoded block, mm."""
    start, frames = track.first_frame(index), track.frames_in(index)
    part = slice(start, start + frames)
    truth = joint_and_tip_positions(motion.figure, motion.root[part], motion.rotations[part])
    decoded = joint_and_tip_positions(
        track.figure, *decode_motion_block(track, block, prior).pose_at(np.arange(frames, dtype=np.float64))
    )
    error: Array = np.linalg.norm(decoded - truth, axis=-1) * 1e3
    return error
