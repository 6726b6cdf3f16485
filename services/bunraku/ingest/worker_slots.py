"""The places at which jobs are at work, of which there are a few: the rest wait. What they do is counted here."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any, Literal

from bunraku.ingest import worker
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.metrics import LabelledHistograms

_log = logging.getLogger(__name__)


class WorkerSlots(asyncio.Semaphore):
    """Those of one replica: whoever has one may `run` a job."""

    def __init__(self, count: int) -> None:
        super().__init__(count)
        self.waiting_jobs = 0
        """Those who wait for a place."""
        self.running_jobs = 0
        """Jobs that run."""
        self.durations = LabelledHistograms()
        """By the job's kind and outcome, what it took."""

    async def acquire(self) -> Literal[True]:
        """As `asyncio.Semaphore`."""
        self.waiting_jobs += 1
        try:
            return await super().acquire()
        finally:
            self.waiting_jobs -= 1

    async def run_job(
        self,
        kind: worker.JobKind,
        arguments: tuple[Any, ...],
        timeout_s: float,
        progress: Callable[[float], None] = lambda _: None,
    ) -> JobResult | JobRejection:
        """As `worker.run`."""
        begun, outcome = time.perf_counter(), "broken off"
        self.running_jobs += 1
        try:
            made = await worker.run_job(kind, arguments, timeout_s, progress)
            outcome = "made" if isinstance(made, JobResult) else "refused"
            return made
        finally:
            self.running_jobs -= 1
            took = time.perf_counter() - begun
            self.durations.observe((kind, outcome), took)
            _log.info("job", extra={"job": kind, "motion": arguments[0], "outcome": outcome, "seconds": round(took, 3)})
