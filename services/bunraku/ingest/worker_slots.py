"""Slots that limit the jobs running on one replica, with metrics of the jobs."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from bunraku.ingest import job_process
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.metrics import LabelledHistograms

MAX_RUNNING_JOBS = 2
"""Jobs that run at the same time; further ones wait."""

_log = logging.getLogger(__name__)


class WorkerSlots:
    """Worker slots of one replica. Hold one while calling `run_job`.

    One subject holds at most all slots but one, and a free slot goes to the subject that holds the fewest: the jobs of
    one subject do not delay those of others.
    """

    def __init__(
        self,
        count: int = MAX_RUNNING_JOBS,
        clock: Callable[[], float] = time.perf_counter,
        prepared: asyncio.Event | None = None,
    ) -> None:
        """`clock` measures the durations of jobs, in seconds. Jobs wait until `prepared` is set, if it is given."""
        self._count = count
        self._prepared = prepared
        self._clock = clock
        self._held = Counter[str]()
        self._waiters: list[tuple[str, asyncio.Future[None]]] = []
        self.running_jobs = 0
        self.durations = LabelledHistograms()
        """Durations of jobs by kind and outcome."""

    @property
    def waiting_jobs(self) -> int:
        """Number of jobs that wait for a slot."""
        return len(self._waiters)

    @property
    def is_preparing(self) -> bool:
        """Return whether no job can run yet, because what all need is being prepared."""
        return self._prepared is not None and not self._prepared.is_set()

    def locked(self) -> bool:
        """Return whether all slots are held."""
        return self._held.total() >= self._count

    @asynccontextmanager
    async def hold(self, subject: str) -> AsyncIterator[None]:
        """Hold a slot during the block, for a job of `subject`; an empty one is nobody in particular."""
        if self._prepared is not None:
            await self._prepared.wait()
        granted: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiters.append((subject, granted))
        self._grant_slots()
        try:
            await granted
            yield
        finally:
            if granted.done() and not granted.cancelled():
                self._held[subject] -= 1
                self._grant_slots()
            else:
                self._waiters.remove((subject, granted))

    def _grant_slots(self) -> None:
        """Give free slots to waiting jobs: in the order of arrival among subjects that hold equally many."""
        while not self.locked():
            permitted = [one for one in self._waiters if not one[1].done() and self._may_hold_another(one[0])]
            if not permitted:
                return
            subject, granted = waiter = min(permitted, key=lambda one: self._held[one[0]])
            self._waiters.remove(waiter)
            self._held[subject] += 1
            granted.set_result(None)

    def _may_hold_another(self, subject: str) -> bool:
        return not subject or self._held[subject] < max(self._count - 1, 1)

    async def run_job(
        self,
        kind: JobKind,
        arguments: tuple[Any, ...],
        timeout_s: float,
        on_progress: Callable[[float], None] = lambda _: None,
    ) -> JobResult | JobRejection:
        """Run a job as `job_process.run_job` does; count and log it."""
        started_at, outcome = self._clock(), "broken off"
        self.running_jobs += 1
        try:
            result = await job_process.run_job(kind, arguments, timeout_s, on_progress)
            outcome = "made" if isinstance(result, JobResult) else "refused"
            return result
        finally:
            self.running_jobs -= 1
            duration_s = self._clock() - started_at
            self.durations.observe((kind, outcome), duration_s)
            fields = {"job": kind, "motion": arguments[0], "outcome": outcome, "seconds": round(duration_s, 3)}
            _log.info("job", extra=fields)
