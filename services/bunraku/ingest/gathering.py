"""What a job does to bring performers together: a motion anew, with those of others beside its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bunraku.backing.library import Dance, StoredMotion, with_performers
from bunraku.codec.decode import decode_block
from bunraku.ingest.results import Made, Refused
from bunraku.motion import rotation
from bunraku.motion.place import Place, in_a_row
from bunraku.motion.rotation import Array
from bunraku.wire.messages import Data

ARMS = 0.75
"""Metres to either side of a dancer's root that are the dancer's."""
ROAMING = 1.5
"""Metres to either side of its middle that a dance is given room for at most: who walks further meets another."""
GAP = 0.1
"""Metres between two."""
MOST_OF_THE_TIME = 2.0, 98.0
"""Percentiles of a dance's places between which it counts as being."""


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
    """Places in a row, each wide enough for its dance, all facing z."""
    middles, reaches = [], []
    for nth, dance in enumerate(dances):
        floor = _floor(dance)
        turn = rotation.about_axis(1, np.array(-dance.front))
        low, high = np.percentile(rotation.rotate(turn, floor)[:, 0], MOST_OF_THE_TIME)
        reaches.append(min((high - low) / 2, ROAMING) + ARMS)
        # the middle of where it is once turned, turned back
        turned = np.percentile(rotation.rotate(turn, floor), MOST_OF_THE_TIME, axis=0).mean(axis=0)
        middles.append(rotation.rotate(rotation.conjugate(turn), turned)[[0, 2]])
        progress((nth + 1) / len(dances))
    return in_a_row(middles, reaches, [-dance.front for dance in dances], GAP)


def _floor(dance: Dance) -> Array:
    """Where the root is, (frames, 3) metres, by the blocks of the lowest rate."""
    return np.concatenate(
        [
            decode_block(dance.track, Data.unpack(packet).block).at(np.arange(float(dance.track.frames_in(index))))[0]
            for index, packet in enumerate(dance.packets[0])
        ]
    )
