"""What a job does to bring performers together: a motion anew, with those of others beside its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from bunraku.backing.library import Dance, StoredMotion, with_performers
from bunraku.codec.decode import decode_block
from bunraku.ingest.results import Made, Refused
from bunraku.motion import rotation
from bunraku.motion.place import Place, in_a_row
from bunraku.motion.rotation import Array
from bunraku.wire.messages import Data

ROOM = 1.6
"""Metres between the roots of two who dance side by side: an arm of each, and a little."""
ROAMING = 2.0
"""Metres more, at most, that two are given who go towards each other: who walks further meets the other."""
MOST_OF_THE_TIME = 2.0, 98.0
"""Percentiles of a dance's places between which it counts as being."""
STEP = 0.1
"""Seconds between two looks at where they are."""


def gather(
    motion: str,
    stored: StoredMotion,
    others: Sequence[StoredMotion],
    places: Sequence[Place] | None,
    progress: Callable[[float], None] = lambda _: None,
) -> Made | Refused:
    """The motion `stored` with the performers of `others` beside its own, as the motion of this new id: at `places`,
    one for each performer, or side by side. `progress` is told the share done, 0..1."""
    dances = [dance for one in (stored, *others) for dance in one.dances]
    if places is None:
        places = side_by_side(dances, progress)
    if len(places) != len(dances):
        return Refused(
            "Invalid request", f"{len(dances)} performers have {len(dances)} places, not {len(places)}", field="places"
        )
    try:
        packed, kinds = with_performers(motion, stored, others, places)
    except ValueError as error:
        return Refused("Too many performers", str(error), field="motions")
    return Made(packed, {"tracks": kinds, "performers": len(dances), "made_from": stored.id})


def side_by_side(dances: Sequence[Dance], progress: Callable[[float], None] = lambda _: None) -> list[Place]:
    """Places in a row, all facing z, as near as two may be who go where their dances take them at the same time."""
    times = np.arange(0.0, max(dances[0].track.duration_us * 1e-6, STEP), STEP)
    middles: list[Array] = []
    across: list[Array] = []
    for nth, dance in enumerate(dances):
        floor, turn = _floor(dance), rotation.about_axis(1, np.array(-dance.front))
        turned = rotation.rotate(turn, floor)
        middle = np.percentile(turned, MOST_OF_THE_TIME, axis=0).mean(axis=0)
        middles.append(rotation.rotate(rotation.conjugate(turn), middle)[[0, 2]])
        # one that is over stands still
        frames = np.minimum((times * dance.track.fps).astype(int), len(floor) - 1)
        across.append(turned[frames, 0] - middle[0])
        progress((nth + 1) / len(dances))
    towards = [np.percentile(left - right, MOST_OF_THE_TIME[1]) for left, right in pairwise(across)]
    apart = [ROOM + float(np.clip(nearer, 0.0, ROAMING)) for nearer in towards]
    return in_a_row(middles, apart, [-dance.front for dance in dances])


def _floor(dance: Dance) -> Array:
    """Where the root is, (frames, 3) metres, by the blocks of the lowest rate."""
    return np.concatenate(
        [
            decode_block(dance.track, Data.unpack(packet).block).at(np.arange(float(dance.track.frames_in(index))))[0]
            for index, packet in enumerate(dance.packets[0])
        ]
    )
