"""Reception of uploaded files: limited in number, size and time, persisted before they are processed."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Coroutine
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from starlette.requests import ClientDisconnect, Request

from bunraku.http.access_control import access_of
from bunraku.http.admission import AdmissionLimit, holder_of
from bunraku.http.disconnect import run_until_disconnect
from bunraku.http.large_body import write_body
from bunraku.ingest.job_queue import JobQueue, UploadJob
from bunraku.ingest.persistence import check_quota
from bunraku.ingest.progress import UploadProgress
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.insufficient_storage import translate_disk_full
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.temporary_folder import temporary_folder

UPLOAD_NAME_PATTERN = r"^[A-Za-z0-9_-]{8,64}$"
"""Pattern of an upload's name, which its client chooses at random."""
FILE_REQUEST_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
"""Request body of an upload in the OpenAPI document."""
MAX_UPLOADS = 64
"""Uploads that are received, wait for a worker slot or are processed at the same time; further ones get 503."""
MAX_UPLOADS_PER_HOLDER = 8
"""Uploads of one subject, or of one address without a subject, at the same time."""

Outcome = TypeVar("Outcome")
JobFactory = Callable[[bytes], UploadJob]
"""Function that describes the job for a file, from its SHA-256 digest."""
JobRunner = Callable[[UploadJob, Path, UploadProgress], Coroutine[Any, Any, Outcome]]
"""Function that persists and runs a job on a received file."""
SourceWriter = Callable[[Path, UploadProgress], Awaitable[UploadJob]]
"""Function that writes the file of a job and describes the job."""


class UploadRules(NamedTuple):
    """What files of one kind may be uploaded."""

    max_bytes: int
    too_large_hint: str
    check_quota: Callable[[str], Awaitable[None]]
    """Function that raises `ProblemError` (403) if a subject cannot store one more."""


class UploadReceiver:
    """Uploads in progress on one replica.

    An upload occupies a worker slot only when its file has arrived, so that slow clients delay no others.
    """

    def __init__(self, context: ServiceContext, job_queue: JobQueue) -> None:
        self._context = context
        self._job_queue = job_queue
        self._limit = AdmissionLimit("uploads", MAX_UPLOADS, MAX_UPLOADS_PER_HOLDER)
        self._progress: dict[tuple[str, str], UploadProgress] = {}
        self._motion_rules = UploadRules(
            context.settings.upload_bytes, "cut it into shorter clips", partial(check_quota, context)
        )

    @property
    def active_count(self) -> int:
        """Number of uploads in progress."""
        return self._limit.active_count

    def get_progress(self, subject: str, upload: str) -> UploadProgress | None:
        """Return the progress of an upload of a subject by the name that its client chose, None if there is none."""
        return self._progress.get((subject, upload))

    async def receive(
        self,
        request: Request,
        upload: str | None,
        create_job: JobFactory,
        run_job: JobRunner[Outcome],
        rules: UploadRules | None = None,
    ) -> Outcome:
        """Receive the file in the request's body, run its job and return what it stored.

        Meanwhile `get_progress` reports on it by the name `upload`, to the same subject only. Without `rules`, those of
        motions apply. Raise `ProblemError`, or `ClientDisconnect` if the client disconnects: the job is then cancelled
        and discarded.
        """
        rules = rules or self._motion_rules

        async def write_source(path: Path, progress: UploadProgress) -> UploadJob:
            return create_job(await self._write_body(request, path, progress, rules))

        return await self._process(request, upload, write_source, run_job, rules)

    async def run(
        self, request: Request, upload: str | None, job: UploadJob, source: bytes, run_job: JobRunner[Outcome]
    ) -> Outcome:
        """Run a job whose file is `source`, and return what it stored; the rest is as for `receive`."""

        async def write_source(path: Path, _: UploadProgress) -> UploadJob:
            await asyncio.to_thread(path.write_bytes, source)
            return job

        return await self._process(request, upload, write_source, run_job, self._motion_rules)

    async def _process(
        self,
        request: Request,
        upload: str | None,
        write_source: SourceWriter,
        run_job: JobRunner[Outcome],
        rules: UploadRules,
    ) -> Outcome:
        subject = access_of(request).subject
        await rules.check_quota(subject)
        with self._limit.admit(holder_of(request)):
            # unnamed uploads get a name that no client can request
            key = (subject, upload or f"/{secrets.token_hex()}")
            if key in self._progress:
                detail = f"another upload in progress has the name {upload!r}"
                raise ProblemError(409, "Name in use", detail, field="upload")
            progress = self._progress[key] = UploadProgress()
            try:
                with translate_disk_full("this server"), temporary_folder("upload") as folder:
                    path = folder / "source"
                    job = await write_source(path, progress)
                    return await self._run_job(request, job, run_job(job, path, progress))
            finally:
                del self._progress[key]

    async def _run_job(self, request: Request, job: UploadJob, run: Coroutine[Any, Any, Outcome]) -> Outcome:
        try:
            return await run_until_disconnect(request, run)
        except ClientDisconnect:
            await self._job_queue.discard_job(job.id)
            raise

    async def _write_body(self, request: Request, path: Path, progress: UploadProgress, rules: UploadRules) -> bytes:
        """Write the body to `path` and return its SHA-256 digest."""
        limit = rules.max_bytes
        content_length = int(request.headers.get("content-length") or 0)

        def check_size(size: int) -> None:
            if size > limit:
                raise ProblemError(
                    413, "Too large", f"a file may have {limit} bytes", limit=limit, hint=rules.too_large_hint
                )

        def on_received(size: int) -> None:
            check_size(size)
            progress.advance_to("receiving", size / content_length if content_length else 0.0)

        check_size(content_length)
        return await write_body(request.stream(), path, on_received)
