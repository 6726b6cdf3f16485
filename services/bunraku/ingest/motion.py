"""What is on its way in: bounded in number, size and time, never half stored, and not forgotten once it is here."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import os
import secrets
import tempfile
from collections.abc import Callable, Coroutine
from pathlib import Path, PurePath
from typing import Any

from starlette.requests import ClientDisconnect, Request

from bunraku.http.access_control import access_of
from bunraku.http.problem_details import ProblemError, translate_disk_full
from bunraku.ingest.job_queue import JobQueue
from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry

MAX_RUNNING_JOBS = 2
"""Jobs that are at work at the same time; the rest wait."""
MAX_ACTIVE_UPLOADS = 16
"""Uploads that may be under way; one more is told to come again."""
WRITE_CHUNK_BYTES = 1 << 20

UploadConsumer = Callable[[bytes, Path, UploadProgress], Coroutine[Any, Any, tuple[CatalogueEntry, bool]]]
"""Makes a motion of a file: of its SHA-256, where it lies, and what is told how far that is. Whether it is new, too."""
JobDetailsBuilder = Callable[[bytes], tuple[str, dict[str, Any]]]
"""Of a file's SHA-256, the id of the job that makes it a motion, and what it needs to know beside the file."""


def derive_motion_id(digest: bytes) -> str:
    """The id of the file with this SHA-256: the same bytes have the same id. 20 characters, a-z and 2-7."""
    return base64.b32encode(digest).decode().lower()[:20]


class UploadOperation:
    """The uploads of one replica."""

    def __init__(self, backing: ServiceContext) -> None:
        """Upon `backing`; `places` are of the jobs that are at work at the same time."""
        self._backing = backing
        self.worker_slots = WorkerSlots(MAX_RUNNING_JOBS)
        self.job_queue = JobQueue(backing, self.worker_slots)
        self.job_queue.handlers["motion"] = self._resume_job
        self._active: dict[str, UploadProgress] = {}

    @property
    def active_count(self) -> int:
        """How many there are now."""
        return len(self._active)

    def get_progress(self, upload: str) -> UploadProgress | None:
        """How far an upload is by the name that its sender gave it, None when it is not, or no longer, under way."""
        return self._active.get(upload)

    async def upload_motion(
        self, request: Request, filename: str, upload: str | None = None
    ) -> tuple[CatalogueEntry, bool]:
        """The motion of the request's body, and whether it is new. `upload` and errors as of `receive`."""
        subject = access_of(request).subject

        async def add(digest: bytes, path: Path, progress: UploadProgress) -> tuple[CatalogueEntry, bool]:
            return await self.ingest_file(derive_motion_id(digest), path, filename, progress, subject=subject)

        def details(digest: bytes) -> tuple[str, dict[str, Any]]:
            motion = derive_motion_id(digest)
            return motion, {"kind": "motion", "motion": motion, "filename": filename, "subject": subject}

        return await self.receive_upload(request, upload, details, add)

    async def _resume_job(self, details: dict[str, Any], path: Path) -> None:
        """As `queue.Make`."""
        await self.ingest_file(details["motion"], path, details["filename"], subject=details.get("subject", ""))

    async def receive_upload(
        self, request: Request, upload: str | None, job_details: JobDetailsBuilder, consumer: UploadConsumer
    ) -> tuple[CatalogueEntry, bool]:
        """What `add` makes of the file in the request's body, and whether that is new; while it is under way its
        `progress` can be asked for by the name `upload`. `details` say how another replica would make it, should this
        one end meanwhile.

        Raises `ProblemError`, and `ClientDisconnect` where the sender goes away: all that was begun is then ended.
        """
        await check_quota(self._backing, access_of(request).subject)
        if len(self._active) >= MAX_ACTIVE_UPLOADS:
            raise ProblemError(
                503, "Busy", f"{MAX_ACTIVE_UPLOADS} uploads are under way", hint="try again in a few seconds"
            )
        if upload in self._active:
            raise ProblemError(409, "Name in use", f"another upload is called {upload!r}", field="upload")
        # a name that nobody can ask for, where none was given
        name = upload or f"/{secrets.token_hex()}"
        progress = self._active[name] = UploadProgress()
        try:
            with translate_disk_full("this server"), tempfile.TemporaryDirectory(prefix="bunraku-upload-") as folder:
                path = Path(folder) / "source"
                digest = await self._write_body(request, path, progress)
                job, said = job_details(digest)

                async def noted() -> tuple[CatalogueEntry, bool]:
                    async with self.job_queue.persist_job(job, said, path):
                        return await consumer(digest, path, progress)

                try:
                    return await _run_until_disconnect(request, noted())
                except ClientDisconnect:
                    await self.job_queue.discard_job(job)
                    raise
        finally:
            del self._active[name]

    async def ingest_file(
        self, motion_id: str, path: Path, filename: str, progress: UploadProgress | None = None, *, subject: str = ""
    ) -> tuple[CatalogueEntry, bool]:
        """The motion of the file at `path`, whose id is `motion`, stored by `subject`, and whether it is new; raises
        `ProblemError`."""
        progress = progress or UploadProgress()
        progress.advance_to("waiting")
        known = await self._backing.catalogue.get_motion(motion_id)
        if known is not None and await self._backing.motion_store.get(motion_id) is not None:
            return known, False
        async with self.worker_slots:
            progress.advance_to("reading")
            seconds = self._backing.settings.upload_seconds
            made = await self.worker_slots.run_job(
                "make", (motion_id, path), seconds, lambda share: progress.advance_to("encoding", share)
            )
        size = await asyncio.to_thread(os.path.getsize, path)
        if known is not None and isinstance(made, JobResult):
            # stored in a codec that is no longer spoken: made anew
            await self._backing.catalogue.remove_motion(motion_id)
        return await self._store_result(motion_id, made, filename, size, subject)

    async def _write_body(self, request: Request, path: Path, progress: UploadProgress) -> bytes:
        """Write the body to `path`; its SHA-256."""
        limit = self._backing.settings.upload_bytes
        too_large = ProblemError(
            413, "Too large", f"a file may have {limit} bytes", limit=limit, hint="cut it into shorter clips"
        )
        announced = int(request.headers.get("content-length") or 0)
        if announced > limit:
            raise too_large
        digest, size, pending = hashlib.sha256(), 0, bytearray()
        with path.open("wb") as file:
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit:
                    raise too_large
                progress.advance_to("receiving", size / announced if announced else 0.0)
                digest.update(chunk)
                pending += chunk
                if len(pending) >= WRITE_CHUNK_BYTES:
                    await asyncio.to_thread(file.write, bytes(pending))
                    pending.clear()
            file.write(pending)
        return digest.digest()

    async def _store_result(
        self, motion: str, result: JobResult | JobRejection, filename: str, size: int, subject: str
    ) -> tuple[CatalogueEntry, bool]:
        if isinstance(result, JobRejection):
            raise ProblemError(
                422,
                result.title,
                result.detail,
                line=result.line,
                field=result.field,
                hint=result.hint,
                filename=filename,
            )
        described = {
            "name": PurePath(filename).stem or filename,
            "filename": filename,
            "bytes": size,
            **result.description,
        }
        return await store_motion(self._backing, motion, result, described, subject)


async def _run_until_disconnect(
    request: Request, operation: Coroutine[Any, Any, tuple[CatalogueEntry, bool]]
) -> tuple[CatalogueEntry, bool]:
    """The result of `making`, broken off when the sender of the request goes away."""
    adding = asyncio.create_task(operation)
    leaving = asyncio.create_task(_wait_for_disconnect(request))
    try:
        await asyncio.wait((adding, leaving), return_when=asyncio.FIRST_COMPLETED)
        if not adding.done():
            raise ClientDisconnect
        return adding.result()
    finally:
        adding.cancel()
        leaving.cancel()
        await asyncio.wait((adding, leaving))


async def _wait_for_disconnect(request: Request) -> None:
    """Wait until the sender of a request whose body is read has gone away."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
