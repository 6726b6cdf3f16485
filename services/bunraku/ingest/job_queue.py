"""Uploads that must not be forgotten: what was received whole is kept with a note of it until it is a motion.

A replica that dies at work leaves both behind. The note's time runs out, and whichever replica finds it makes the
motion: the sender has got no answer, and need not send again. Who goes away while waiting takes the upload back.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from bunraku.http import request_id
from bunraku.http.problem_details import ProblemError
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.clock import clock
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import Job

POLL_INTERVAL_S = 2.0
"""Seconds between two looks for jobs that nobody is at; as often those that are held here are held on."""
JOB_LEASE_US = 8_000_000
"""Microseconds for which a job is held from each look on."""
REQUEST_ID_KEY = "request_id"
"""Of a job's details, what the request that sent it is called."""
MAX_ATTEMPTS = 3
"""Times that a job is begun again: one that ends its replica each time is given up."""

JobHandler = Callable[[dict[str, Any], Path], Awaitable[object]]
"""Makes a motion of a job's details and the file that was sent; raises `ProblemError` where there is none in it."""

_log = logging.getLogger(__name__)


class JobQueue:
    """The jobs of one replica, and those that others left. `kinds` says how each kind is made; whoever makes some adds
    them."""

    def __init__(self, backing: ServiceContext, worker_slots: asyncio.Semaphore) -> None:
        """Nothing is taken up while all `places` are at work."""
        self._backing = backing
        self._worker_slots = worker_slots
        self._replica_id = secrets.token_hex(8)
        self._held_jobs: set[str] = set()
        self._resumed_tasks: set[asyncio.Task[None]] = set()
        self.handlers: dict[str, JobHandler] = {}
        self.resumed_jobs = 0
        """Jobs taken up that another replica left."""

    @asynccontextmanager
    async def persist_job(self, job_id: str, details: dict[str, Any], path: Path) -> AsyncIterator[None]:
        """While this lasts the file at `path` is in the library, and the catalogue has a job of this id to make a
        motion of it, as `details` with its `kind` say. It stays there only where this replica ends meanwhile.

        Raises `Unavailable`, and `ProblemError` where there is no room.
        """
        library, catalogue = self._backing.motion_store, self._backing.catalogue
        await library.put_source(job_id, await asyncio.to_thread(path.read_bytes))
        self._held_jobs.add(job_id)
        try:
            await catalogue.add_job(
                Job(job_id, clock(), {**details, REQUEST_ID_KEY: request_id.current()}, 0),
                self._replica_id,
                clock() + JOB_LEASE_US,
            )
            yield
        except asyncio.CancelledError:
            # whoever ends it knows whether it is to be forgotten
            raise
        except BaseException:
            await self.discard_job(job_id)
            raise
        else:
            await self.discard_job(job_id)
        finally:
            self._held_jobs.discard(job_id)

    async def discard_job(self, job_id: str) -> None:
        """A job is done, or nobody wants it. One that the catalogue cannot be told of now is found done later."""
        with contextlib.suppress(BackendUnavailable):
            await self._backing.catalogue.remove_job(job_id)
            await self._backing.motion_store.remove_source(job_id)

    async def run(self) -> None:
        """Hold what is at work here, and take up what nobody is at; until cancelled."""
        try:
            while True:
                await asyncio.sleep(POLL_INTERVAL_S)
                try:
                    if self._held_jobs:
                        await self._backing.catalogue.renew_jobs(self._replica_id, clock() + JOB_LEASE_US)
                    if not self._worker_slots.locked():
                        await self._claim_abandoned_job()
                except BackendUnavailable:
                    # whoever needs it now says so
                    continue
                except Exception:
                    _log.exception("jobs could not be looked after; trying again")
        finally:
            for task in self._resumed_tasks:
                task.cancel()
            await asyncio.gather(*self._resumed_tasks, return_exceptions=True)

    async def release_jobs(self) -> None:
        """Leave to others what is not done."""
        with contextlib.suppress(BackendUnavailable):
            await self._backing.catalogue.renew_jobs(self._replica_id, 0)

    async def _claim_abandoned_job(self) -> None:
        now = clock()
        job = await self._backing.catalogue.claim_job(self._replica_id, now, now + JOB_LEASE_US)
        if job is None or job.id in self._held_jobs:
            return
        self._held_jobs.add(job.id)
        working = asyncio.create_task(self._resume_job(job), name=f"job {job.id}")
        self._resumed_tasks.add(working)
        working.add_done_callback(self._resumed_tasks.discard)

    async def _resume_job(self, job: Job) -> None:
        """Make what another replica began, in the name of the request that sent it."""
        with request_id.bind(job.details.get(REQUEST_ID_KEY, "")):
            await self._run_resumed_job(job)

    async def _run_resumed_job(self, job: Job) -> None:
        self.resumed_jobs += 1
        try:
            make, source = (
                self.handlers.get(job.details.get("kind", "")),
                await self._backing.motion_store.get_source(job.id),
            )
            if make is None or source is None or job.tries > MAX_ATTEMPTS:
                _log.error("job %s is given up: %s, begun %d times", job.id, job.details, job.tries)
            else:
                _log.warning("job %s was left by its server and is done here", job.id)
                with tempfile.TemporaryDirectory(prefix="bunraku-job-") as folder:
                    path = Path(folder) / "source"
                    await asyncio.to_thread(path.write_bytes, source)
                    await make(job.details, path)
        except ProblemError as error:
            if error.status >= 500:
                # of this moment, not of the file: it is taken up again
                _log.warning("job %s: %s; trying again", job.id, error.detail)
                return
            _log.warning("job %s: %s", job.id, error.detail)
        except BackendUnavailable as error:
            _log.warning("job %s: %s; trying again", job.id, error)
            return
        finally:
            self._held_jobs.discard(job.id)
        await self.discard_job(job.id)
