"""Operation that turns an uploaded motion file into a stored motion."""

from __future__ import annotations

import asyncio
import hashlib
import os
from pathlib import Path, PurePath

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.job_queue import JobDetails, UploadJob
from bunraku.ingest.persistence import StoreOutcome, check_quota, store_motion
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import require_result
from bunraku.ingest.source_file import SourceFile, clean_filename
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import MAX_NAME_CHARACTERS, clean_text
from bunraku.storage.motion_id import derive_job_id, derive_motion_id


def create_motion_job(digest: bytes, filename: str, subject: str, take: str | None = None) -> UploadJob:
    """Describe the job for a motion file with this SHA-256 digest, or for one of its takes."""
    motion_id = derive_motion_id(digest) if take is None else derive_take_id(digest, take)
    filename = clean_filename(filename)
    job_id = derive_job_id(motion_id, subject)
    details = {"kind": "motion", "motion": motion_id, "filename": filename, "subject": subject}
    return UploadJob(job_id, details if take is None else {**details, "take": take})


def derive_take_id(digest: bytes, take: str) -> str:
    """Return the id of the motion of one take of a file with this SHA-256 digest."""
    return derive_motion_id(hashlib.sha256(digest + take.encode()).digest())


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
        await check_quota(self._context, source.subject)
        async with self._worker_slots.hold(source.subject):
            progress.advance_to("reading")
            outcome = await self._worker_slots.run_job(
                JobKind.MOTION,
                (motion_id, source.path, source.take, source.is_one_of_several),
                self._context.settings.upload_seconds,
                lambda share: progress.advance_to("encoding", share),
            )
        result = require_result(outcome, filename=source.filename)
        description = {
            "name": _name_motion(source),
            "filename": source.filename,
            "bytes": await asyncio.to_thread(os.path.getsize, source.path),
            **result.description,
        }
        return await store_motion(self._context, motion_id, result, description, source.subject, known)


def _name_motion(source: SourceFile) -> str:
    """Return the file's name, followed by that of the take."""
    stem = PurePath(source.filename).stem
    if source.take is None:
        return clean_text(stem) or source.filename
    # cut, so that takes of a file with a long name can be told apart
    file, take = clean_text(stem, MAX_NAME_CHARACTERS // 2), clean_text(source.take)
    return clean_text(f"{file} \N{EN DASH} {take}" if file and take else file or take) or source.filename
