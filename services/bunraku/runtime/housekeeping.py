"""Removal of what ended processes left behind, at the start of a process and daily."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import MEMORY_BUS
from bunraku.runtime.temporary_folder import sweep_temporary_folders, try_lock
from bunraku.storage.integrity import hide_incomplete_motions, sweep_objects

SWEEP_INTERVAL_S = 86_400.0
ORPHAN_LIFETIME_S = 86_400.0
"""Age from which objects that nothing refers to are removed, if other processes may use them."""
MAINTENANCE_INTERVAL_S = 60.0
"""Interval at which reserved space is restored and a sweep that failed is tried again."""
OWNER_FILE = "owner"
"""File in the library's folder that the process which uses it alone keeps locked."""

_log = logging.getLogger(__name__)


class Housekeeping:
    """Housekeeping of one process."""

    def __init__(self, context: ServiceContext, *, has_library: bool, clock: Callable[[], float] = time.time) -> None:
        """With `has_library`, check the motions, too. `clock` returns seconds since 1970."""
        self._context = context
        self._has_library = has_library
        self._clock = clock
        self._started_at = clock()
        self._is_alone = False

    async def run(self, delay_s: float) -> None:
        """Sweep now and daily, until cancelled; check the motions for the first time after `delay_s`."""
        async with self._own_library():
            await asyncio.to_thread(self._sweep_folders)
            await asyncio.sleep(delay_s)
            swept_at: float | None = None
            while True:
                now = self._clock()
                try:
                    if swept_at is None or now - swept_at >= SWEEP_INTERVAL_S:
                        if swept_at is not None:
                            await asyncio.to_thread(self._sweep_folders)
                        await self.check_library()
                        swept_at = now
                    if self._has_library:
                        await self._context.catalogue.restore_reserve()
                except (BackendUnavailable, ProblemError):
                    # logged by the requests that need the backend
                    pass
                except Exception:
                    _log.exception("Housekeeping failed; trying again")
                await asyncio.sleep(MAINTENANCE_INTERVAL_S)

    async def check_library(self) -> None:
        """Hide incomplete motions and remove objects that nothing refers to."""
        if not self._has_library:
            return
        catalogue, motion_store = self._context.catalogue, self._context.motion_store
        await hide_incomplete_motions(catalogue, motion_store)
        # whatever is older than the only process that uses the folder was left by an ended one
        oldest = self._started_at if self._is_alone else 0.0
        await sweep_objects(catalogue, motion_store, max(oldest, self._clock() - ORPHAN_LIFETIME_S))

    def _sweep_folders(self) -> None:
        if removed := sweep_temporary_folders():
            _log.warning("Removed %d temporary folders that ended processes left behind", removed)

    @asynccontextmanager
    async def _own_library(self) -> AsyncIterator[None]:
        """Find out whether this process is the only one that uses a local library; hold its lock meanwhile."""
        library_url = self._context.settings.library_url()
        lock: int | None = None
        if self._has_library and self._context.settings.bus == MEMORY_BUS and library_url.startswith("file://"):
            # a read-only folder, or Windows
            with contextlib.suppress(OSError, ImportError):
                lock = await asyncio.to_thread(try_lock, Path(library_url.removeprefix("file://")) / OWNER_FILE)
        self._is_alone = lock is not None
        try:
            yield
        finally:
            if lock is not None:
                os.close(lock)
