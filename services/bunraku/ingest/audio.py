"""Operation that derives a motion with the sound of an uploaded file."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.ingest.derived_motion import Derivation, DerivedMotionFactory
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.job_queue import JobDetails, UploadJob
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.source_file import SourceFile, clean_filename
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.storage.motion_id import derive_digest, derive_job_id
from bunraku.storage.record import CatalogueEntry


def create_audio_job(motion_id: str, digest: bytes, filename: str, subject: str) -> UploadJob:
    """Describe the job that adds the sound file with this SHA-256 digest to a motion."""
    details = {
        "kind": "audio",
        "motion": motion_id,
        "digest": digest.hex(),
        "filename": clean_filename(filename),
        "subject": subject,
    }
    return UploadJob(derive_job_id(motion_id, subject, digest), details)


class AudioOperation:
    """Addition of sound files to motions."""

    def __init__(self, context: ServiceContext, worker_slots: WorkerSlots) -> None:
        self._derived_motions = DerivedMotionFactory(context, worker_slots)
        self._worker_slots = worker_slots
        self._timeout_s = context.settings.upload_seconds

    async def require_motion(self, motion_id: str) -> None:
        """Raise `ProblemError` (404) if a motion does not exist, before its sound file is received."""
        await self._derived_motions.require_motion(motion_id)

    async def run_job(self, details: JobDetails, path: Path, progress: UploadProgress) -> StoreOutcome:
        """Run a job of `create_audio_job` (a `JobHandler`)."""
        source = SourceFile(path, details["filename"], details.get("subject", ""))
        return await self.add_audio(details["motion"], source, bytes.fromhex(details["digest"]), progress)

    async def add_audio(
        self, motion_id: str, source: SourceFile, digest: bytes, progress: UploadProgress | None = None
    ) -> StoreOutcome:
        """Derive a motion with the sound of a file with this SHA-256 digest; raise `ProblemError`."""
        upload_progress = progress or UploadProgress()
        upload_progress.advance_to("preparing" if self._worker_slots.is_preparing else "waiting")

        async def run(new_id: str, stored: StoredMotion) -> JobResult | JobRejection:
            upload_progress.advance_to("reading")
            return await self._worker_slots.run_job(
                JobKind.AUDIO,
                (new_id, stored, source.path),
                self._timeout_s,
                lambda share: upload_progress.advance_to("encoding", share),
            )

        async def describe(base: CatalogueEntry, result: JobResult) -> dict[str, Any]:
            size = await asyncio.to_thread(os.path.getsize, source.path)
            audio = {"filename": source.filename, "bytes": size, **result.description["audio"]}
            return {**base.description, **result.description, "audio": audio}

        return await self._derived_motions.find_or_create(
            Derivation(
                motion_id,
                derive_digest(motion_id, b" with the sound " + digest),
                run,
                describe,
                source.subject,
                {"filename": source.filename},
            )
        )
