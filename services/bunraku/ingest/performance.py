"""Operation that makes motions of live performances, once they have ended."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import JobRejection, require_result
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.lease import hold_lease
from bunraku.messaging.performance_request import PERFORMANCE_KEY_PREFIX, PERFORMANCE_SUBJECT, performed_subject
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.storage.performance_store import Recorded

SCAN_INTERVAL_S = 60.0
"""Interval at which performances without an announced end are looked for."""
ABANDONED_AFTER_S = 90.0
"""Age of the last change from which a performance has ended: its connection stores the header every 20 s."""
LIFETIME_S = 7 * 86_400.0
"""Age of the last change from which samples that could not become a motion, for lack of space, are removed."""
MAX_ACTIVE_PERFORMANCES = 4
JOB_TIMEOUT_S = 600.0
"""Time limit of the encoding of one performance."""

_log = logging.getLogger(__name__)


class PerformanceOperation:
    """Motions of ended performances."""

    def __init__(
        self, context: ServiceContext, worker_slots: WorkerSlots, wall_clock: Callable[[], float] = time.time
    ) -> None:
        """`wall_clock` returns seconds since 1970, as the object store counts them."""
        self._context = context
        self._worker_slots = worker_slots
        self._wall_clock = wall_clock
        self._store = context.motion_store.performances
        self._requested: set[str] = set()
        self._has_requests = asyncio.Event()
        self._slots = asyncio.Semaphore(MAX_ACTIVE_PERFORMANCES)

    async def run(self) -> None:
        """Make motions of the performances that have ended, until cancelled."""
        subscription = self._context.bus.subscribe(PERFORMANCE_SUBJECT, self._request)
        try:
            while True:
                try:
                    await self.make_motions()
                except (BackendUnavailable, ProblemError) as error:
                    _log.warning("performances not read: %s; trying again", error)
                except Exception:
                    _log.exception("performances not read; trying again")
                try:
                    await asyncio.wait_for(self._has_requests.wait(), SCAN_INTERVAL_S)
                except TimeoutError:
                    continue
        finally:
            subscription.unsubscribe()

    async def make_motions(self) -> None:
        """Make motions of all requested and abandoned performances."""
        self._has_requests.clear()
        requested, self._requested = self._requested, set()
        now = self._wall_clock()
        performances = await self._store.list_performances()
        ended = [
            performer
            for performer, stored in performances.items()
            if performer in requested or stored.modified < now - ABANDONED_AFTER_S
        ]
        async with asyncio.TaskGroup() as tasks:
            for performer in ended:
                tasks.create_task(self._make_motion_in_turn(performer))

    def _request(self, performer: bytes) -> None:
        self._requested.add(performer.decode("ascii", "replace"))
        self._has_requests.set()

    async def _make_motion_in_turn(self, performer: str) -> None:
        try:
            lease = hold_lease(self._context.key_values, f"{PERFORMANCE_KEY_PREFIX}.{performer}")
            async with self._slots, lease:
                await self._make_motion(performer)
        except (BackendUnavailable, ProblemError) as error:
            _log.warning("performance %s is not a motion yet: %s", performer, error)
        except Exception:
            _log.exception("performance %s is not a motion yet", performer)

    async def _make_motion(self, performer: str) -> None:
        # another replica may have made it meanwhile
        stored = (await self._store.list_performances()).get(performer)
        if stored is None:
            return
        recorded = await self._store.load(performer, stored)
        if recorded is None or stored.modified < self._wall_clock() - LIFETIME_S:
            _log.warning("the samples of performance %s are removed: nothing says what to make of them", performer)
        elif recorded.parts:
            await self._encode(recorded)
        await self._store.remove(performer, stored)
        if recorded is not None and recorded.parts:
            self._context.bus.publish(performed_subject(performer), recorded.header.motion.encode())

    async def _encode(self, recorded: Recorded) -> None:
        """Store the motion of a performance; one without enough samples is dropped. Raise `ProblemError`."""
        header, context = recorded.header, self._context
        await check_quota(context, header.subject)
        async with self._worker_slots.hold(header.subject):
            outcome = await self._worker_slots.run_job(
                JobKind.PERFORMANCE, (header.motion, header, recorded.parts), JOB_TIMEOUT_S
            )
        if isinstance(outcome, JobRejection):
            _log.warning("performance %s has no motion: %s: %s", header.id, outcome.title, outcome.detail)
            return
        result = require_result(outcome)
        description = {
            "name": clean_text(header.name),
            "filename": "",
            "bytes": sum(map(len, recorded.parts)),
            "source": "performed live",
            **result.description,
        }
        await store_motion(context, header.motion, result, description, header.subject)
