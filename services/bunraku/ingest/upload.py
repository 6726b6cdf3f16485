"""Reception of uploaded files: limited in number, size and time, persisted before they are processed."""

from __future__ import annotations

import asyncio
import hashlib
import secrets
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from starlette.requests import ClientDisconnect, Request

from bunraku.http.access_control import access_of
from bunraku.ingest.admission import AdmissionLimit
from bunraku.ingest.job_queue import JobQueue, UploadJob
from bunraku.ingest.persistence import StoreOutcome, check_quota
from bunraku.ingest.progress import UploadProgress
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.insufficient_storage import translate_disk_full
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.temporary_folder import temporary_folder

WRITE_CHUNK_BYTES = 1 << 20

JobFactory = Callable[[bytes], UploadJob]
"""Function that describes the job for a file, from its SHA-256 digest."""


class UploadReceiver:
    """Uploads in progress on one replica."""

    def __init__(self, context: ServiceContext, job_queue: JobQueue) -> None:
        self._context = context
        self._job_queue = job_queue
        self._limit = AdmissionLimit("uploads")
        self._progress_by_name: dict[str, UploadProgress] = {}

    @property
    def active_count(self) -> int:
        """Number of uploads in progress."""
        return self._limit.active_count

    def get_progress(self, upload: str) -> UploadProgress | None:
        """Return the progress of an upload by the name that its client chose, None if it is not in progress."""
        return self._progress_by_name.get(upload)

    async def receive(self, request: Request, upload: str | None, create_job: JobFactory) -> StoreOutcome:
        """Receive the file in the request's body, run its job and return the stored motion.

        Meanwhile `get_progress` reports on it by the name `upload`. Raise `ProblemError`, or `ClientDisconnect` if the
        client disconnects: the job is then cancelled and discarded.
        """
        await check_quota(self._context, access_of(request).subject)
        with self._limit:
            if upload in self._progress_by_name:
                detail = f"another upload in progress has the name {upload!r}"
                raise ProblemError(409, "Name in use", detail, field="upload")
            # unnamed uploads get a name that no client can request
            name = upload or f"/{secrets.token_hex()}"
            progress = self._progress_by_name[name] = UploadProgress()
            try:
                return await self._receive(request, create_job, progress)
            finally:
                del self._progress_by_name[name]

    async def _receive(self, request: Request, create_job: JobFactory, progress: UploadProgress) -> StoreOutcome:
        with translate_disk_full("this server"), temporary_folder("upload") as folder:
            path = folder / "source"
            job = create_job(await self._write_body(request, path, progress))
            try:
                return await _run_until_disconnect(request, self._job_queue.run_job(job, path, progress))
            except ClientDisconnect:
                await self._job_queue.discard_job(job.id)
                raise

    async def _write_body(self, request: Request, path: Path, progress: UploadProgress) -> bytes:
        """Write the body to `path` and return its SHA-256 digest."""
        limit = self._context.settings.upload_bytes
        too_large = ProblemError(
            413, "Too large", f"a file may have {limit} bytes", limit=limit, hint="cut it into shorter clips"
        )
        content_length = int(request.headers.get("content-length") or 0)
        if content_length > limit:
            raise too_large
        digest, size, pending = hashlib.sha256(), 0, bytearray()
        with path.open("wb") as file:
            async for chunk in request.stream():
                size += len(chunk)
                if size > limit:
                    raise too_large
                progress.advance_to("receiving", size / content_length if content_length else 0.0)
                digest.update(chunk)
                pending += chunk
                if len(pending) >= WRITE_CHUNK_BYTES:
                    await asyncio.to_thread(file.write, bytes(pending))
                    pending.clear()
            file.write(pending)
        return digest.digest()


async def _run_until_disconnect(request: Request, operation: Coroutine[Any, Any, StoreOutcome]) -> StoreOutcome:
    """Return the result of `operation`; cancel it and raise `ClientDisconnect` if the client disconnects."""
    running = asyncio.create_task(operation)
    disconnect = asyncio.create_task(_wait_for_disconnect(request))
    try:
        await asyncio.wait((running, disconnect), return_when=asyncio.FIRST_COMPLETED)
        if not running.done():
            raise ClientDisconnect
        return running.result()
    finally:
        running.cancel()
        disconnect.cancel()
        await asyncio.wait((running, disconnect))


async def _wait_for_disconnect(request: Request) -> None:
    """Wait for the disconnect of a client whose request body has been read."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
