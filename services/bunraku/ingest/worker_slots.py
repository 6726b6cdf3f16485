"""Slots that limit the jobs running on one replica, with metrics of the jobs."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any, Literal

from bunraku.ingest import job_process
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.metrics import LabelledHistograms

MAX_RUNNING_JOBS = 2
"""Jobs that run at the same time; further ones wait."""

_log = logging.getLogger(__name__)


class WorkerSlots(asyncio.Semaphore):
    """Worker slots of one replica. Acquire one before `run_job`."""

    def __init__(self, count: int = MAX_RUNNING_JOBS, clock: Callable[[], float] = time.perf_counter) -> None:
        """`clock` measures the durations of jobs, in seconds."""
        super().__init__(count)
        self._clock = clock
        self.waiting_jobs = 0
        """Jobs that wait for a slot."""
        self.running_jobs = 0
        self.durations = LabelledHistograms()
        """Durations of jobs by kind and outcome."""

    async def acquire(self) -> Literal[True]:
        self.waiting_jobs += 1
        try:
            return await super().acquire()
        finally:
            self.waiting_jobs -= 1

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
