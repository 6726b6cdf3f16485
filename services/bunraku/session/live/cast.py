"""Cast of a session with live performers: the motion that it would play without them, and the performers themselves.

The stage plays one motion, the *cast motion*: the performers of the stored motion, then a figure at rest for each live
performer, on which the live poses are shown. Every change of the cast makes another cast motion; its id is a hash of
the cast, so that a replica that takes over finds it. Cast motions are not in the library.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgpack
import numpy as np

from bunraku.codec.container import StoredMotion, add_performers, pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.motion import rotation
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import JOINT_COUNT, Figure, Motion
from bunraku.storage.motion_id import derive_digest, derive_motion_id

SPACING_M = 1.6
"""Distance of a performer without a place from the nearest one, in metres along x."""
_REST_FPS = 10.0
_REST_DURATION_S = 10.0
_REST_ERROR_MM = 1.0


@dataclass(frozen=True, slots=True)
class CastMember:
    """Live performer of a session."""

    id: str
    name: str
    fps: float
    """Samples per second that are expected."""
    place: tuple[float, float, float] | None
    """Placement on the stage, None for the next free place."""
    subject: str = ""
    """Subject of the token that brought the performer; empty without access control."""

    @property
    def rest_motion(self) -> str:
        """Id of the motion of the figure at rest."""
        return derive_motion_id(derive_digest(self.id, b" at rest"))


@dataclass(frozen=True, slots=True)
class Cast:
    """Live performers, and the stored motion that is played with them; none if `base` is empty."""

    base: str = ""
    members: tuple[CastMember, ...] = ()

    @property
    def motion(self) -> str:
        """Id of the cast motion."""
        if not self.members:
            return self.base
        return derive_motion_id(derive_digest(self.base, msgpack.packb([(one.id, one.place) for one in self.members])))

    def find(self, performer: str) -> CastMember | None:
        """Return a performer by id, or None."""
        return next((one for one in self.members if one.id == performer), None)

    def without(self, performer: str) -> Cast:
        """Return the cast without a performer."""
        return Cast(self.base, tuple(one for one in self.members if one.id != performer))

    def to_values(self) -> list[Any]:
        """Return the cast as values of MessagePack."""
        members = [[one.id, one.name, one.fps, one.place, one.subject] for one in self.members]
        return [self.base, members]

    @classmethod
    def from_values(cls, values: Any) -> Cast:
        """Parse the values of `to_values`, or those of a later release; raise ValueError or TypeError."""
        base, members = values[:2]
        return cls(
            base,
            tuple(
                CastMember(one, name, fps, None if place is None else (place[0], place[1], place[2]), subject)
                for one, name, fps, place, subject in (member[:5] for member in members)
            ),
        )


EMPTY_CAST = Cast()


def pack_rest_motion(motion_id: str, figure: Figure) -> bytes:
    """Return the object of a motion in which a figure stands at rest at the centre of the stage."""
    frames = round(_REST_FPS * _REST_DURATION_S)
    root = np.tile([0.0, figure.offsets[0, 1], 0.0], (frames, 1))
    still = Motion(figure, _REST_FPS, root, np.tile(rotation.IDENTITY, (frames, JOINT_COUNT, 1)))
    return pack_motion(motion_id, encode_motion(still, error_bounds_mm=(_REST_ERROR_MM,), grade="live"))


def pack_cast_motion(cast: Cast, base: StoredMotion | None, rest_motions: Sequence[StoredMotion]) -> bytes:
    """Return the object of the cast motion; `rest_motions` are those of the members. Raise ValueError for too many."""
    motions = [base, *rest_motions] if base is not None else list(rest_motions)
    placements = [performer.placement for performer in base.performers] if base is not None else []
    for member in cast.members:
        next_place = Placement(max((place.x for place in placements), default=-SPACING_M) + SPACING_M)
        placements.append(next_place if member.place is None else Placement(*member.place))
    return add_performers(cast.motion, motions[0], motions[1:], placements)[0]
