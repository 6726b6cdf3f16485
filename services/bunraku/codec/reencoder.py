"""Encoding of stored motions anew, as a later encoder needs fewer bytes for the same bound.

The source of a stored motion is gone. Its highest level is known to differ from it by at most that level's bound; so a
lower level whose blocks differ from the highest by at most the difference of both bounds still meets its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.motion_encoder import BitrateLevel, EncodingGrade, measure_level
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.prior import load_shipped_prior
from bunraku.motion.skeleton import Motion

LevelMapper = Callable[[Callable[[BitrateLevel], BitrateLevel], Iterable[BitrateLevel]], Iterable[BitrateLevel]]
"""A function like `map`, for example the `map` of a thread pool."""


def reencode_lower_levels(
    track: MotionTrack,
    motion: Motion,
    ladder: Sequence[BitrateLevel],
    grade: EncodingGrade = "best",
    on_progress: Callable[[float], None] = lambda _: None,
    map_levels: LevelMapper = map,
) -> list[BitrateLevel]:
    """Return the ladder of a track in which each block is the smaller one of the stored and the newly encoded.

    `motion` is the decoded highest level, which stays as it is, so that repetitions add no errors. The mean errors of
    changed levels are upper limits: those from the highest level, and its own, added. `on_progress` receives the share
    that is done, 0..1, from the threads of `map_levels`.
    """
    encoder, highest = BlockEncoder(track, motion, load_shipped_prior()), ladder[-1]
    finished = count(1)

    def reencode(level: BitrateLevel) -> BitrateLevel:
        blocks: list[bytes] = []
        step: int | None = None
        for index, stored in enumerate(level.blocks):
            bound_mm = level.error_bound_mm - highest.error_bound_mm
            data = stored
            if bound_mm > 0.0:
                encoded = encoder.encode_within_bound(index, bound_mm, grade, step)
                step, data = encoded.step, encoded.data
            blocks.append(min(stored, data, key=len))
            on_progress(next(finished) / (track.block_count * (len(ladder) - 1)))
        if blocks == level.blocks:
            return level
        measured = measure_level(track, motion, blocks, np.inf)
        mean_error_mm = measured.mean_error_mm + highest.mean_error_mm
        return replace(measured, mean_error_mm=mean_error_mm, error_bound_mm=level.error_bound_mm)

    # the highest levels take longest, so start with them
    return [*list(map_levels(reencode, ladder[-2::-1]))[::-1], highest]
