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

from bunraku.backing import request_id
from bunraku.backing.backing import Backing, clock
from bunraku.backing.catalogue import Job
from bunraku.backing.problems import ProblemError
from bunraku.backing.unavailable import Unavailable

LOOK = 2.0
"""Seconds between two looks for jobs that nobody is at; as often those that are held here are held on."""
HELD = 8_000_000
"""Microseconds for which a job is held from each look on."""
REQUEST = "request_id"
"""Of a job's details, what the request that sent it is called."""
TRIES = 3
"""Times that a job is begun again: one that ends its replica each time is given up."""

Make = Callable[[dict[str, Any], Path], Awaitable[object]]
"""Makes a motion of a job's details and the file that was sent; raises `ProblemError` where there is none in it."""

_log = logging.getLogger(__name__)


class Queue:
    """The jobs of one replica, and those that others left. `kinds` says how each kind is made; whoever makes some adds
    them."""

    def __init__(self, backing: Backing, places: asyncio.Semaphore) -> None:
        """Nothing is taken up while all `places` are at work."""
        self._backing = backing
        self._places = places
        self._me = secrets.token_hex(8)
        self._held: set[str] = set()
        self._working: set[asyncio.Task[None]] = set()
        self.kinds: dict[str, Make] = {}
        self.resumed = 0
        """Jobs taken up that another replica left."""

    @asynccontextmanager
    async def noted(self, job: str, details: dict[str, Any], path: Path) -> AsyncIterator[None]:
        """While this lasts the file at `path` is in the library, and the catalogue has a job of this id to make a
        motion of it, as `details` with its `kind` say. It stays there only where this replica ends meanwhile.

        Raises `Unavailable`, and `ProblemError` where there is no room.
        """
        library, catalogue = self._backing.library, self._backing.catalogue
        await library.put_source(job, await asyncio.to_thread(path.read_bytes))
        self._held.add(job)
        try:
            await catalogue.add_job(
                Job(job, clock(), {**details, REQUEST: request_id.current()}, 0), self._me, clock() + HELD
            )
            yield
        except asyncio.CancelledError:
            # whoever ends it knows whether it is to be forgotten
            raise
        except BaseException:
            await self.forget(job)
            raise
        else:
            await self.forget(job)
        finally:
            self._held.discard(job)

    async def forget(self, job: str) -> None:
        """A job is done, or nobody wants it. One that the catalogue cannot be told of now is found done later."""
        with contextlib.suppress(Unavailable):
            await self._backing.catalogue.remove_job(job)
            await self._backing.library.remove_source(job)

    async def run(self) -> None:
        """Hold what is at work here, and take up what nobody is at; until cancelled."""
        try:
            while True:
                await asyncio.sleep(LOOK)
                try:
                    if self._held:
                        await self._backing.catalogue.hold_jobs(self._me, clock() + HELD)
                    if not self._places.locked():
                        await self._look()
                except Unavailable:
                    # whoever needs it now says so
                    continue
                except Exception:
                    _log.exception("jobs could not be looked after; trying again")
        finally:
            for task in self._working:
                task.cancel()
            await asyncio.gather(*self._working, return_exceptions=True)

    async def close(self) -> None:
        """Leave to others what is not done."""
        with contextlib.suppress(Unavailable):
            await self._backing.catalogue.hold_jobs(self._me, 0)

    async def _look(self) -> None:
        now = clock()
        job = await self._backing.catalogue.claim_job(self._me, now, now + HELD)
        if job is None or job.id in self._held:
            return
        self._held.add(job.id)
        working = asyncio.create_task(self._again(job), name=f"job {job.id}")
        self._working.add(working)
        working.add_done_callback(self._working.discard)

    async def _again(self, job: Job) -> None:
        """Make what another replica began, in the name of the request that sent it."""
        with request_id.at_work(job.details.get(REQUEST, "")):
            await self._made(job)

    async def _made(self, job: Job) -> None:
        self.resumed += 1
        try:
            make, source = self.kinds.get(job.details.get("kind", "")), await self._backing.library.get_source(job.id)
            if make is None or source is None or job.tries > TRIES:
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
        except Unavailable as error:
            _log.warning("job %s: %s; trying again", job.id, error)
            return
        finally:
            self._held.discard(job.id)
        await self.forget(job.id)
