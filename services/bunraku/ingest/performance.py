"""Operation that makes motions of live performances, once they have ended."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from functools import partial

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.persistence import check_quota, store_motion
from bunraku.ingest.result import NOTHING_TO_KEEP, JobRejection, require_result
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.lease import hold_lease
from bunraku.messaging.performance_request import PERFORMANCE_KEY_PREFIX, PERFORMANCE_SUBJECT, performed_subject
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.storage.performance_store import PerformanceHeader, StoredPerformance

SCAN_INTERVAL_S = 60.0
"""Interval at which performances without an announced end are looked for."""
ABANDONED_AFTER_S = 90.0
"""Age of the last change from which a performance has ended: its connection stores the header every 20 s."""
LIFETIME_S = 7 * 86_400.0
"""Age of the last change from which samples that could not become a motion are removed."""
MAX_ACTIVE_PERFORMANCES = 2
"""Performances that are encoded at the same time; one of an hour at 240 samples per second has 120 MB."""
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
        self._tasks: dict[str, asyncio.Task[None]] = {}
        # performances whose encoding failed; a repetition would fail too
        self._failed: set[str] = set()

    async def run(self) -> None:
        """Make motions of the performances that have ended, until cancelled."""
        subscription = self._context.bus.subscribe(PERFORMANCE_SUBJECT, self._request)
        try:
            while True:
                try:
                    await self._start_tasks()
                except (BackendUnavailable, ProblemError) as error:
                    _log.warning("performances not read: %s; trying again", error)
                except Exception:
                    _log.exception("performances not read; trying again")
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._has_requests.wait(), SCAN_INTERVAL_S)
        finally:
            subscription.unsubscribe()
            for task in self._tasks.values():
                task.cancel()
            await asyncio.gather(*self._tasks.values(), return_exceptions=True)

    async def make_motions(self) -> None:
        """Make motions of all requested and abandoned performances."""
        await self._start_tasks()
        await asyncio.gather(*self._tasks.values())

    async def _start_tasks(self) -> None:
        """Start a task for each performance that has ended: a long one does not keep others waiting."""
        self._has_requests.clear()
        requested, self._requested = self._requested, set()
        now = self._wall_clock()
        for performer, stored in (await self._store.list_performances()).items():
            has_ended = performer in requested or stored.modified < now - ABANDONED_AFTER_S
            if has_ended and performer not in self._tasks:
                task = asyncio.create_task(self._make_motion_in_turn(performer), name=f"performance {performer}")
                self._tasks[performer] = task
                task.add_done_callback(partial(self._on_done, performer))

    def _on_done(self, performer: str, _: asyncio.Task[None]) -> None:
        del self._tasks[performer]

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
        header = await self._read_header(performer)
        is_lost = header is None or stored.modified < self._wall_clock() - LIFETIME_S
        if is_lost or (header is not None and await self._store_motion(header, stored)):
            await self._store.remove(performer, stored)

    async def _read_header(self, performer: str) -> PerformanceHeader | None:
        try:
            return await self._store.get_header(performer)
        except ValueError as error:
            _log.warning("performance %s: %s", performer, error)
            return None

    async def _store_motion(self, header: PerformanceHeader, stored: StoredPerformance) -> bool:
        """Make and store the motion of a performance. Return whether its samples are not needed any more.

        Raise `ProblemError`.
        """
        context = self._context
        if header.id in self._failed:
            return False
        # before any work, as this is repeated until there is room
        await check_quota(context, header.subject)
        parts = await self._store.load(header.id, stored)
        if not any(parts):
            return True
        async with self._worker_slots.hold(header.subject):
            outcome = await self._worker_slots.run_job(
                JobKind.PERFORMANCE, (header.motion, header, parts), JOB_TIMEOUT_S
            )
        if isinstance(outcome, JobRejection):
            _log.warning("performance %s has no motion: %s: %s", header.id, outcome.title, outcome.detail)
            if outcome.title == NOTHING_TO_KEEP:
                return True
            self._failed.add(header.id)
            return False
        result = require_result(outcome)
        description = {
            "name": clean_text(header.name),
            "filename": "",
            "bytes": sum(map(len, parts)),
            "source": "performed live",
            **result.description,
        }
        await store_motion(context, header.motion, result, description, header.subject)
        context.bus.publish(performed_subject(header.id), header.motion.encode())
        return True
