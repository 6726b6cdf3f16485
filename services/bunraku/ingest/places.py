"""The places at which jobs are at work, of which there are a few: the rest wait. What they do is counted here."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any, Literal

from bunraku.backing.metrics import Distributions
from bunraku.ingest import jobs
from bunraku.ingest.results import Made, Refused

_log = logging.getLogger(__name__)


class Places(asyncio.Semaphore):
    """Those of one replica: whoever has one may `run` a job."""

    def __init__(self, places: int) -> None:
        super().__init__(places)
        self.waiting = 0
        """Those who wait for a place."""
        self.at_work = 0
        """Jobs that run."""
        self.times = Distributions()
        """By the job's kind and outcome, what it took."""

    async def acquire(self) -> Literal[True]:
        """As `asyncio.Semaphore`."""
        self.waiting += 1
        try:
            return await super().acquire()
        finally:
            self.waiting -= 1

    async def run(
        self,
        job: jobs.Job,
        arguments: tuple[Any, ...],
        seconds: float,
        progress: Callable[[float], None] = lambda _: None,
    ) -> Made | Refused:
        """As `jobs.run`."""
        begun, outcome = time.perf_counter(), "broken off"
        self.at_work += 1
        try:
            made = await jobs.run(job, arguments, seconds, progress)
            outcome = "made" if isinstance(made, Made) else "refused"
            return made
        finally:
            self.at_work -= 1
            took = time.perf_counter() - begun
            self.times.add((job, outcome), took)
            _log.info("job", extra={"job": job, "motion": arguments[0], "outcome": outcome, "seconds": round(took, 3)})
