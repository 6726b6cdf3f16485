"""Motions derived from a stored motion, which stays unchanged.

The id of a derived motion is a hash of its source and of the addition, so that a repeated operation finds it again.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.http.problem_details import motion_not_found
from bunraku.ingest.persistence import StoreOutcome, check_quota, store_motion
from bunraku.ingest.result import JobRejection, JobResult, require_result
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.storage.motion_id import derive_motion_id
from bunraku.storage.record import CatalogueEntry

DerivationJob = Callable[[str, StoredMotion], Awaitable[JobResult | JobRejection]]
"""Function that derives the motion of a new id from the stored one; it runs while a worker slot is held."""
DescriptionBuilder = Callable[[CatalogueEntry, JobResult], Awaitable[dict[str, Any]]]
"""Function that describes the new motion, from the entry of its source and the result of the job."""


@dataclass(frozen=True, slots=True)
class Derivation:
    """A motion to derive."""

    source_id: str
    digest: bytes
    """Identity of the new motion, by `derive_digest`: equal additions to one motion give the same motion."""
    run: DerivationJob
    describe: DescriptionBuilder
    subject: str = ""
    """Subject that stores the motion."""
    problem_members: Mapping[str, str] = field(default_factory=dict)
    """Further members of the problem document if the job rejects its input."""


class DerivedMotionFactory:
    """Creation of derived motions."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._context = context
        self._worker_slots = worker_slots

    async def require_motion(self, motion_id: str) -> CatalogueEntry:
        """Return the entry of a stored motion; raise `ProblemError` (404) if it does not exist."""
        entry = await self._context.catalogue.get_motion(motion_id)
        if entry is None:
            raise motion_not_found(motion_id)
        await self.require_object(motion_id)
        return entry

    async def require_object(self, motion_id: str) -> StoredMotion:
        """Return a stored motion; raise `ProblemError` (404) if it does not exist."""
        stored = await self._context.motion_store.get(motion_id)
        if stored is None:
            raise motion_not_found(motion_id)
        return stored

    async def find_or_create(self, derivation: Derivation) -> StoreOutcome:
        """Return the derived motion, created unless it is stored already; raise `ProblemError`."""
        context = self._context
        source = await self.require_motion(derivation.source_id)
        motion_id = derive_motion_id(derivation.digest)
        known = await context.catalogue.get_motion(motion_id)
        if known is not None and await context.motion_store.get(motion_id) is not None:
            return StoreOutcome(known, False)
        await check_quota(context, derivation.subject)
        async with self._worker_slots.hold(derivation.subject):
            # loaded only now, as the source may have been removed while this waited
            outcome = await derivation.run(motion_id, await self.require_object(derivation.source_id))
        result = require_result(outcome, **derivation.problem_members)
        description = await derivation.describe(source, result)
        return await store_motion(context, motion_id, result, description, derivation.subject, known)
