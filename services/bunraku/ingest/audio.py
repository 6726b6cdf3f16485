"""Sound for motions: a motion stays as it is, and a new one is made that is the same with audio beside it."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any

from starlette.requests import Request

from bunraku.codec.container import StoredMotion
from bunraku.http.access_control import access_of
from bunraku.ingest.derived_motion import DerivedMotionFactory
from bunraku.ingest.motion import UploadOperation, derive_motion_id
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry


class AudioOperation:
    """The sounds that come to one replica, as uploads beside its `uploads`."""

    def __init__(self, backing: ServiceContext, uploads: UploadOperation) -> None:
        self._uploads = uploads
        self._derived_motions = DerivedMotionFactory(backing, uploads)
        self._worker_slots = uploads.worker_slots
        self._timeout_s = backing.settings.upload_seconds
        uploads.job_queue.handlers["audio"] = self._resume_job

    async def upload_audio(
        self, request: Request, motion: str, filename: str, upload: str | None = None
    ) -> tuple[CatalogueEntry, bool]:
        """The motion `motion` with the sound of the request's body, and whether it is new. `upload` and errors as of
        `Uploads.receive`; a motion that there is not raises `ProblemError` before the body is read."""
        await self._derived_motions.require_motion(motion)
        subject = access_of(request).subject

        async def add(digest: bytes, path: Path, progress: UploadProgress) -> tuple[CatalogueEntry, bool]:
            return await self.add_audio(motion, digest, path, filename, progress, subject=subject)

        def details(digest: bytes) -> tuple[str, dict[str, Any]]:
            said = {"kind": "audio", "motion": motion, "digest": digest.hex(), "filename": filename, "subject": subject}
            return f"{motion}-{derive_motion_id(digest)}", said

        return await self._uploads.receive_upload(request, upload, details, add)

    async def _resume_job(self, details: dict[str, Any], path: Path) -> None:
        """As `queue.Make`."""
        digest, subject = bytes.fromhex(details["digest"]), details.get("subject", "")
        await self.add_audio(details["motion"], digest, path, details["filename"], subject=subject)

    async def add_audio(
        self,
        motion: str,
        digest: bytes,
        path: Path,
        filename: str,
        progress: UploadProgress | None = None,
        *,
        subject: str = "",
    ) -> tuple[CatalogueEntry, bool]:
        """The motion `motion` with the sound of the file at `path`, whose SHA-256 is `digest`, stored by `subject`, and
        whether it is new; raises `ProblemError`."""
        under_way = progress or UploadProgress()
        under_way.advance_to("waiting")

        async def sing(made: str, stored: StoredMotion) -> JobResult | JobRejection:
            under_way.advance_to("reading")
            return await self._worker_slots.run_job(
                "add", (made, stored, path), self._timeout_s, lambda share: under_way.advance_to("encoding", share)
            )

        async def described(before: CatalogueEntry, made: JobResult) -> dict[str, Any]:
            size = await asyncio.to_thread(os.path.getsize, path)
            audio = {"filename": filename, "bytes": size, **made.description["audio"]}
            return {**before.description, **made.description, "audio": audio}

        with_what = b" with the sound " + digest
        return await self._derived_motions.find_or_create(
            motion, with_what, sing, described, subject=subject, filename=filename
        )
