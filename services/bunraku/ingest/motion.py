"""Operation that turns an uploaded motion file into a stored motion."""

from __future__ import annotations

import asyncio
import hashlib
import os
from pathlib import Path, PurePath

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.job_queue import JobDetails, UploadJob
from bunraku.ingest.persistence import StoreOutcome, store_motion
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import require_result
from bunraku.ingest.source_file import SourceFile, clean_filename
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.storage.motion_id import derive_job_id, derive_motion_id


def create_motion_job(digest: bytes, filename: str, subject: str, take: str | None = None) -> UploadJob:
    """Describe the job for a motion file with this SHA-256 digest, or for one of its takes."""
    if take is not None:
        digest = hashlib.sha256(digest + take.encode()).digest()
    motion_id, filename = derive_motion_id(digest), clean_filename(filename)
    job_id = derive_job_id(motion_id, subject)
    details = {"kind": "motion", "motion": motion_id, "filename": filename, "subject": subject}
    return UploadJob(job_id, details if take is None else {**details, "take": take})


class MotionOperation:
    """Ingestion of motion files."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._context = context
        self._worker_slots = worker_slots

    async def run_job(self, details: JobDetails, path: Path, progress: UploadProgress) -> StoreOutcome:
        """Run a job of `create_motion_job` (a `JobHandler`)."""
        source = SourceFile(path, details["filename"], details.get("subject", ""), details.get("take"))
        return await self.ingest_file(details["motion"], source, progress)

    async def ingest_file(
        self, motion_id: str, source: SourceFile, progress: UploadProgress | None = None
    ) -> StoreOutcome:
        """Encode a motion file and store it, unless it is stored already; raise `ProblemError`."""
        progress = progress or UploadProgress()
        progress.advance_to("preparing" if self._worker_slots.is_preparing else "waiting")
        known = await self._context.catalogue.get_motion(motion_id)
        if known is not None and await self._context.motion_store.get(motion_id) is not None:
            return StoreOutcome(known, False)
        async with self._worker_slots.hold(source.subject):
            progress.advance_to("reading")
            outcome = await self._worker_slots.run_job(
                JobKind.MOTION,
                (motion_id, source.path, source.take),
                self._context.settings.upload_seconds,
                lambda share: progress.advance_to("encoding", share),
            )
        result = require_result(outcome, filename=source.filename)
        description = {
            "name": clean_text(source.take or PurePath(source.filename).stem) or source.filename,
            "filename": source.filename,
            "bytes": await asyncio.to_thread(os.path.getsize, source.path),
            **result.description,
        }
        return await store_motion(self._context, motion_id, result, description, source.subject, known)
