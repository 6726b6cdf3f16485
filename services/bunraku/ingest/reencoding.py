"""Operation that encodes a stored motion again, in place: its id, name, links and highest level stay."""

from __future__ import annotations

import asyncio
from typing import Any

from bunraku.http.admission import AdmissionLimit
from bunraku.http.problem_details import motion_not_found
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.performers import combined_ladder
from bunraku.ingest.persistence import replace_motion
from bunraku.ingest.result import require_result
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.storage.record import CatalogueEntry

MAX_REENCODINGS = 16
"""Motions that are encoded again, or wait for it, at the same time; further ones get 503."""
MAX_REENCODINGS_PER_SUBJECT = 4


class ReencodingOperation:
    """Motions that are encoded again."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._context = context
        self._worker_slots = worker_slots
        self._timeout_s = context.settings.upload_seconds
        self._limit = AdmissionLimit("encodings", MAX_REENCODINGS, MAX_REENCODINGS_PER_SUBJECT)

    async def reencode(self, motion_id: str, subject: str = "") -> CatalogueEntry:
        """Encode a motion again for `subject`, and return its entry; raise `ProblemError`."""
        with self._limit.admit(subject):
            async with self._worker_slots.hold(subject):
                # loaded only now, as the motion may have been removed while this waited
                stored = await self._context.motion_store.get(motion_id)
                if stored is None:
                    raise motion_not_found(motion_id)
                outcome = await self._worker_slots.run_job(JobKind.REENCODING, (stored,), self._timeout_s)
            result = require_result(outcome)
            rates = combined_ladder(result.description["ladders"])

            def describe(description: dict[str, Any]) -> dict[str, Any]:
                return {**description, "rates": rates}

            replacement = asyncio.create_task(
                replace_motion(self._context, motion_id, result.packed, describe), name=f"replace motion {motion_id}"
            )
            try:
                return await asyncio.shield(replacement)
            finally:
                # a client that leaves now would leave an object of unknown size, which no quota counts
                await asyncio.wait((replacement,))
