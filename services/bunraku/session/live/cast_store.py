"""Cast motions in the motion store."""

from __future__ import annotations

import asyncio

from bunraku.codec.container import StoredMotion
from bunraku.http.problem_details import motion_not_found
from bunraku.motion.skeleton import Figure
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.cast import EMPTY_CAST, Cast, CastMember, pack_cast_motion, pack_rest_motion
from bunraku.storage.motion_store import MotionStore


class CastStore:
    """Store of the motions that stages with live performers play."""

    def __init__(self, motion_store: MotionStore) -> None:
        self._motion_store = motion_store

    async def put_figure(self, member: CastMember, figure: Figure) -> None:
        """Store a performer's figure, as a motion at rest."""
        packed = await asyncio.to_thread(pack_rest_motion, member.rest_motion, figure)
        await self._motion_store.put(member.rest_motion, packed)

    async def load(self, cast: Cast) -> StoredMotion:
        """Return the cast motion, which is made if it does not exist; raise `ProblemError`."""
        stored = await self._motion_store.get(cast.motion)
        if stored is None:
            await self._motion_store.put(cast.motion, await self._pack(cast))
            stored = await self._motion_store.get(cast.motion)
        if stored is None:
            raise motion_not_found(cast.motion)
        return stored

    async def refresh(self, cast: Cast) -> None:
        """Store the motions of a cast again, so that they do not look abandoned."""
        for motion in _own_motions(cast):
            await self._motion_store.touch(motion)

    async def remove(self, cast: Cast, kept: Cast = EMPTY_CAST) -> None:
        """Remove the motions of a cast, except those that another cast needs."""
        needed = _own_motions(kept)
        for motion in _own_motions(cast):
            if motion not in needed:
                await self._motion_store.remove(motion)

    async def _pack(self, cast: Cast) -> bytes:
        base = await self._require(cast.base) if cast.base else None
        rest_motions = [await self._require(member.rest_motion) for member in cast.members]
        try:
            return await asyncio.to_thread(pack_cast_motion, cast, base, rest_motions)
        except ValueError as error:
            raise ProblemError(409, "Stage full", str(error), hint="end a performer, or open another session") from None

    async def _require(self, motion_id: str) -> StoredMotion:
        stored = await self._motion_store.get(motion_id)
        if stored is None:
            raise motion_not_found(motion_id)
        return stored


def _own_motions(cast: Cast) -> list[str]:
    """Return the ids of the motions that exist for a cast only."""
    return [cast.motion, *(member.rest_motion for member in cast.members)] if cast.members else []
