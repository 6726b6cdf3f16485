"""What a job does to bring performers together: a motion anew, with those of others beside its own."""

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
"""Metres between the roots of two who dance side by side: an arm of each, and a little."""
MAX_EXTRA_SPACING_M = 2.0
"""Metres more, at most, that two are given who go towards each other: who walks further meets the other."""
POSITION_PERCENTILES = 2.0, 98.0
"""Percentiles of a dance's places between which it counts as being."""
SAMPLE_INTERVAL_S = 0.1
"""Seconds between two looks at where they are."""


def combine_performers(
    motion_id: str,
    stored: StoredMotion,
    others: Sequence[StoredMotion],
    placements: Sequence[Placement] | None,
    progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """The motion `stored` with the performers of `others` beside its own, as the motion of this new id: at `places`,
    one for each performer, or side by side. `progress` is told the share done, 0..1."""
    dances = [dance for one in (stored, *others) for dance in one.performers]
    if placements is None:
        placements = place_side_by_side(dances, progress)
    if len(placements) != len(dances):
        return JobRejection(
            "Invalid request",
            f"{len(dances)} performers have {len(dances)} places, not {len(placements)}",
            field="places",
        )
    try:
        packed, kinds = add_performers(motion_id, stored, others, placements)
    except ValueError as error:
        return JobRejection("Too many performers", str(error), field="motions")
    return JobResult(packed, {"tracks": kinds, "performers": len(dances), "made_from": stored.id})


def place_side_by_side(
    performers: Sequence[PerformerTracks], progress: Callable[[float], None] = lambda _: None
) -> list[Placement]:
    """Places in a row, all facing z, as near as two may be who go where their dances take them at the same time."""
    times = np.arange(0.0, max(performers[0].track.duration_us * 1e-6, SAMPLE_INTERVAL_S), SAMPLE_INTERVAL_S)
    middles: list[Array] = []
    across: list[Array] = []
    for nth, dance in enumerate(performers):
        floor, turn = _root_trajectory(dance), rotation.from_coordinate_axis(1, np.array(-dance.front))
        turned = rotation.rotate(turn, floor)
        middle = np.percentile(turned, POSITION_PERCENTILES, axis=0).mean(axis=0)
        middles.append(rotation.rotate(rotation.conjugate(turn), middle)[[0, 2]])
        # one that is over stands still
        frames = np.minimum((times * dance.track.fps).astype(int), len(floor) - 1)
        across.append(turned[frames, 0] - middle[0])
        progress((nth + 1) / len(performers))
    towards = [np.percentile(left - right, POSITION_PERCENTILES[1]) for left, right in pairwise(across)]
    apart = [PERFORMER_SPACING_M + float(np.clip(nearer, 0.0, MAX_EXTRA_SPACING_M)) for nearer in towards]
    return place_in_row(middles, apart, [-dance.front for dance in performers])


def _root_trajectory(performer: PerformerTracks) -> Array:
    """Where the root is, (frames, 3) metres, by the blocks of the lowest rate."""
    return np.concatenate(
        [
            decode_motion_block(performer.track, Data.unpack(packet).block).pose_at(
                np.arange(float(performer.track.frames_in(index)))
            )[0]
            for index, packet in enumerate(performer.packets[0])
        ]
    )
