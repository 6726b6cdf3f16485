"""Motions made from another, which stays as it is: found again where the same was made before, else made and stored."""

from __future__ import annotations

import hashlib
from collections.abc import Awaitable, Callable
from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.http.problem_details import ProblemError, motion_not_found
from bunraku.ingest.motion import UploadOperation, derive_motion_id
from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry

DerivationJob = Callable[[str, StoredMotion], Awaitable[JobResult | JobRejection]]
"""Makes the motion of this new id from the stored one."""
DescriptionBuilder = Callable[[CatalogueEntry, JobResult], Awaitable[dict[str, Any]]]
"""What the catalogue says of the new motion, from what it says of the other and what was made."""


class DerivedMotionFactory:
    """Those of one replica. Their jobs take the places of its `uploads`."""

    def __init__(self, backing: ServiceContext, uploads: UploadOperation) -> None:
        self._backing = backing
        self._uploads = uploads

    async def require_motion(self, motion_id: str) -> CatalogueEntry:
        """What the catalogue says of a motion that can be made something of; raises `ProblemError`."""
        entry = await self._backing.catalogue.get_motion(motion_id)
        if entry is None or await self._backing.motion_store.get(motion_id) is None:
            raise motion_not_found(motion_id)
        return entry

    async def find_or_create(
        self,
        source_id: str,
        derivation_key: bytes,
        job: DerivationJob,
        describe: DescriptionBuilder,
        *,
        subject: str = "",
        **problem_fields: str,
    ) -> tuple[CatalogueEntry, bool]:
        """The motion `motion` with something, and whether it is new; `with_what` says with what exactly: the same gives
        the same motion. `subject` is who stores it. Raises `ProblemError`, with `told` where the job refuses."""
        backing = self._backing
        before = await self.require_motion(source_id)
        made_id = derive_motion_id(hashlib.sha256(source_id.encode() + derivation_key).digest())
        known = await backing.catalogue.get_motion(made_id)
        if known is not None and await backing.motion_store.get(made_id) is not None:
            return known, False
        await check_quota(backing, subject)
        async with self._uploads.worker_slots:
            # it may have been removed while this waited
            stored = await backing.motion_store.get(source_id)
            if stored is None:
                raise motion_not_found(source_id)
            made = await job(made_id, stored)
        if isinstance(made, JobRejection):
            raise ProblemError(422, made.title, made.detail, field=made.field, hint=made.hint, **problem_fields)
        if known is not None:
            # stored in a codec that is no longer spoken: made anew
            await backing.catalogue.remove_motion(made_id)
        return await store_motion(backing, made_id, made, await describe(before, made), subject)
