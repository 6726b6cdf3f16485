"""Job that combines the performers of several motions in one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from bunraku.codec.container import PerformerTracks, StoredMotion, add_performers
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion import rotation
from bunraku.motion.placement import Placement, place_in_row
from bunraku.motion.rotation import Array
from bunraku.wire.messages import Data

PERFORMER_SPACING_M = 1.6
"""Distance between the roots of neighbours, in metres: an arm of each and a margin."""
MAX_EXTRA_SPACING_M = 2.0
"""Maximum extra distance for neighbours that move towards each other; beyond it they may meet."""
POSITION_PERCENTILES = 2.0, 98.0
"""Percentiles of the root's positions that bound the area of a performer."""
SAMPLE_INTERVAL_S = 0.1
"""Interval at which the positions of performers are compared, in seconds."""


def combine_performers(
    motion_id: str,
    stored: StoredMotion,
    others: Sequence[StoredMotion],
    placements: Sequence[Placement] | None,
    on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Return a copy of `stored` with the new id and the performers of `others` beside its own.

    `placements` has one item per performer; None places them in a row. `on_progress` receives the completed share,
    0..1.
    """
    performers = [performer for motion in (stored, *others) for performer in motion.performers]
    if placements is None:
        placements = place_side_by_side(performers, on_progress)
    if len(placements) != len(performers):
        detail = f"{len(performers)} performers need {len(performers)} places, not {len(placements)}"
        return JobRejection("Invalid request", detail, field="places")
    try:
        packed, track_kinds = add_performers(motion_id, stored, others, placements)
    except ValueError as error:
        return JobRejection("Too many performers", str(error), field="motions")
    return JobResult(packed, {"tracks": track_kinds, "performers": len(performers), "made_from": stored.id})


def place_side_by_side(
    performers: Sequence[PerformerTracks], on_progress: Callable[[float], None] = lambda _: None
) -> list[Placement]:
    """Return placements in a row, all facing z, as close as simultaneous movements allow."""
    times = np.arange(0.0, max(performers[0].track.duration_us * 1e-6, SAMPLE_INTERVAL_S), SAMPLE_INTERVAL_S)
    centres: list[Array] = []
    lateral: list[Array] = []
    for index, performer in enumerate(performers):
        roots, turn = _root_trajectory(performer), rotation.from_coordinate_axis(1, np.array(-performer.front))
        turned = rotation.rotate(turn, roots)
        centre = np.percentile(turned, POSITION_PERCENTILES, axis=0).mean(axis=0)
        centres.append(rotation.rotate(rotation.conjugate(turn), centre)[[0, 2]])
        # a performer whose motion has ended stands still
        frames = np.minimum((times * performer.track.fps).astype(int), len(roots) - 1)
        lateral.append(turned[frames, 0] - centre[0])
        on_progress((index + 1) / len(performers))
    approaches = [np.percentile(left - right, POSITION_PERCENTILES[1]) for left, right in pairwise(lateral)]
    distances = [PERFORMER_SPACING_M + float(np.clip(metres, 0.0, MAX_EXTRA_SPACING_M)) for metres in approaches]
    return place_in_row(centres, distances, [-performer.front for performer in performers])


def _root_trajectory(performer: PerformerTracks) -> Array:
    """Return the root's positions, (frames, 3) metres, decoded from the lowest bitrate level."""
    return np.concatenate(
        [
            decode_motion_block(performer.track, Data.unpack(packet).block).pose_at(
                np.arange(float(performer.track.frames_in(index)))
            )[0]
            for index, packet in enumerate(performer.packets[0])
        ]
    )
