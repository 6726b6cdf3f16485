"""Queue of received uploads that survives the failure of a replica.

A received file stays in the motion store, with a job in the catalogue, until it is a motion. If a replica fails, its
hold on the job no longer changes and another replica runs the job: the client gets no response, but need not upload
again. A client that disconnects while waiting cancels its job.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.heartbeat_observer import HeartbeatObserver
from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.temporary_folder import temporary_folder
from bunraku.storage.record import Job, JobHold

POLL_INTERVAL_S = 2.0
JOB_LEASE_US = 8_000_000
MAX_OBSERVED_JOBS = 200
"""Number of the oldest jobs that are considered for being resumed."""
REQUEST_ID_KEY = "request_id"
"""Key in a job's details with the id of the HTTP request that uploaded it."""
MAX_ATTEMPTS = 3
"""Number of times that a job is resumed: a job that crashes each replica is given up."""

JobDetails = dict[str, Any]
"""Parameters of a job as JSON; `kind` selects the handler."""
JobHandler = Callable[[JobDetails, Path, UploadProgress], Awaitable[Any]]
"""Function that stores the motions of a job's details and uploaded file; it raises `ProblemError` for a bad file."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class UploadJob:
    """A job with its id and the details from which any replica can run it."""

    id: str
    details: JobDetails


@dataclass(frozen=True, slots=True)
class JobQueueTiming:
    """Intervals of a job queue."""

    poll_s: float = POLL_INTERVAL_S
    """Interval between searches for abandoned jobs and renewals of own jobs, in seconds."""
    lease_us: int = JOB_LEASE_US
    """Time without a renewal after which a job counts as abandoned, in microseconds."""


DEFAULT_TIMING = JobQueueTiming()


class JobQueue:
    """Persistent jobs of one replica, and the abandoned jobs of others."""

    def __init__(
        self,
        context: ServiceContext,
        worker_slots: WorkerSlots,
        handlers: Mapping[str, JobHandler],
        timing: JobQueueTiming = DEFAULT_TIMING,
    ) -> None:
        """`handlers` are by kind of job. Abandoned jobs are resumed only while a worker slot is free."""
        self._context = context
        self._worker_slots = worker_slots
        self._handlers = handlers
        self._timing = timing
        self._replica_id = secrets.token_hex(8)
        self._held_jobs: set[str] = set()
        # own jobs that nothing ran at the last search
        self._left_jobs: set[str] = set()
        self._hold_observer = HeartbeatObserver(timing.lease_us * 1e-6)
        self._resumed_tasks: set[asyncio.Task[None]] = set()
        self.resumed_jobs = 0
        """Number of abandoned jobs that this replica has resumed."""

    async def run_job(self, job: UploadJob, path: Path, progress: UploadProgress) -> StoreOutcome:
        """Persist a job of one motion, run its handler on the file at `path` and remove the job."""
        async with self.persist_job(job, path):
            outcome: StoreOutcome = await self._handlers[job.details["kind"]](job.details, path, progress)
            return outcome

    @asynccontextmanager
    async def persist_job(self, job: UploadJob, path: Path) -> AsyncIterator[None]:
        """Store a job and its file during the block; they stay only if the replica fails or the block is cancelled.

        Raise `BackendUnavailable`, or `ProblemError` (507) without storage space.
        """
        motion_store, catalogue = self._context.motion_store, self._context.catalogue
        await motion_store.put_source(job.id, path)
        self._held_jobs.add(job.id)
        try:
            now = self._context.clock()
            details = {**job.details, REQUEST_ID_KEY: request_id.current()}
            await catalogue.add_job(Job(job.id, now, details), self._replica_id, now + self._timing.lease_us)
            yield
        except asyncio.CancelledError:
            # the canceller decides whether the job is discarded
            raise
        except BaseException:
            await self.discard_job(job.id)
            raise
        else:
            await self.discard_job(job.id)
        finally:
            self._held_jobs.discard(job.id)

    async def discard_job(self, job_id: str) -> None:
        """Remove a job and its file. If the catalogue is unavailable, the job is resumed later and found complete."""
        with contextlib.suppress(BackendUnavailable):
            await self._context.catalogue.remove_job(job_id)
            await self._context.motion_store.remove_source(job_id)

    async def run(self) -> None:
        """Renew the hold on own jobs and resume abandoned ones, until cancelled."""
        try:
            while True:
                await asyncio.sleep(self._timing.poll_s)
                try:
                    if self._held_jobs:
                        held_until = self._context.clock() + self._timing.lease_us
                        await self._context.catalogue.renew_jobs(self._replica_id, held_until)
                    await self._claim_abandoned_job()
                except (BackendUnavailable, ProblemError):
                    # an outage or a full disk, logged by the requests that need the backend
                    continue
                except Exception:
                    _log.exception("Job queue failed; trying again")
        finally:
            for task in self._resumed_tasks:
                task.cancel()
            await asyncio.gather(*self._resumed_tasks, return_exceptions=True)

    async def release_jobs(self) -> None:
        """Release all unfinished jobs to other replicas."""
        with contextlib.suppress(BackendUnavailable):
            await self._context.catalogue.renew_jobs(self._replica_id, 0)

    async def _claim_abandoned_job(self) -> None:
        """Claim the oldest abandoned job if a worker slot is free."""
        catalogue = self._context.catalogue
        holds = await catalogue.list_job_holds(MAX_OBSERVED_JOBS)
        self._hold_observer.observe(holds, asyncio.get_running_loop().time())
        still_left = {job_id for job_id in self._left_jobs if self._is_left(job_id, holds.get(job_id))}
        self._left_jobs = {job_id for job_id, hold in holds.items() if self._is_left(job_id, hold)}
        if self._worker_slots.locked():
            return
        abandoned = next(
            (
                job_id
                for job_id, hold in holds.items()
                if job_id in still_left or self._is_abandoned_by_another(job_id, hold)
            ),
            None,
        )
        if abandoned is None:
            return
        held_until = self._context.clock() + self._timing.lease_us
        job = await catalogue.claim_job(abandoned, holds[abandoned], self._replica_id, held_until)
        # an upload of the same file may have begun here meanwhile
        if job is None or job.id in self._held_jobs:
            return
        self._held_jobs.add(job.id)
        task = asyncio.create_task(self._resume_job(job), name=f"job {job.id}")
        self._resumed_tasks.add(task)
        task.add_done_callback(self._resumed_tasks.discard)

    def _is_left(self, job_id: str, hold: JobHold | None) -> bool:
        """Return whether an own job is not running: it is to be tried again, or is being discarded just now."""
        return hold is not None and hold.holder == self._replica_id and job_id not in self._held_jobs

    def _is_abandoned_by_another(self, job_id: str, hold: JobHold) -> bool:
        """Return whether a job is released, or held by a replica that has stopped."""
        if hold.holder == self._replica_id or job_id in self._held_jobs:
            return False
        return hold.until == 0 or self._hold_observer.has_stopped(job_id)

    async def _resume_job(self, job: Job) -> None:
        """Run an abandoned job under the id of the request that uploaded it."""
        self.resumed_jobs += 1
        try:
            with request_id.bind(job.details.get(REQUEST_ID_KEY, "")):
                if await self._run_resumed_job(job):
                    await self.discard_job(job.id)
        finally:
            # held until it is removed, so that a slow catalogue does not make it look like one to be tried again
            self._held_jobs.discard(job.id)

    async def _run_resumed_job(self, job: Job) -> bool:
        """Return whether the job is finished; a job that is not is tried again."""
        try:
            handler = self._handlers.get(job.details.get("kind", ""))
            with temporary_folder("job") as folder:
                path = folder / "source"
                is_stored = await self._context.motion_store.copy_source(job.id, path)
                if handler is None or not is_stored or job.tries > MAX_ATTEMPTS:
                    _log.error("Job %s given up after %d attempts: %s", job.id, job.tries, job.details)
                else:
                    _log.warning("Job %s was abandoned by its replica; running it here", job.id)
                    await handler(job.details, path, UploadProgress())
        except ProblemError as error:
            if error.status >= 500:
                # not caused by the file: the job is resumed again
                _log.warning("Job %s failed: %s; trying again", job.id, error.detail)
                return False
            _log.warning("Job %s failed: %s", job.id, error.detail)
        except BackendUnavailable as error:
            _log.warning("Job %s failed: %s; trying again", job.id, error)
            return False
        return True
