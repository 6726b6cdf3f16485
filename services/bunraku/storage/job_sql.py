"""The jobs in SQL: what was received and is not yet a motion, and which replica is at it.

A replica holds a job until a time that it moves on while it works; after that the job is anybody's. All times are clock
times in microseconds.
"""

from __future__ import annotations

import json

from sqlalchemy import delete, select, update
from sqlalchemy.ext.asyncio import AsyncEngine

from bunraku.storage.catalogue import Job
from bunraku.storage.table import JOBS, QueryRunner


class SqlJobTable:
    """The table of jobs; each method as that of `Catalogue`."""

    def __init__(self, engine: AsyncEngine, run_query: QueryRunner) -> None:
        self._engine = engine
        self._run_query = run_query

    async def add(self, job: Job, holder: str, held_until: int) -> None:
        """Add a job, or take over the one of the same id."""
        await self._run_query(self._add(job, holder, held_until))

    async def claim(self, holder: str, now: int, held_until: int) -> Job | None:
        """The oldest job that nobody is at, now held here; None where there is none, or another was quicker."""
        return await self._run_query(self._claim(holder, now, held_until))

    async def renew(self, holder: str, held_until: int) -> None:
        """All jobs of a replica are held until then."""
        await self._run_query(self._renew(holder, held_until))

    async def remove(self, job_id: str) -> None:
        """A job is done, or given up."""
        await self._run_query(self._remove(job_id))

    async def _add(self, job: Job, holder: str, held_until: int) -> None:
        held = {"details": json.dumps(job.details), "holder": holder, "until": held_until}
        async with self._engine.begin() as connection:
            if not (await connection.execute(update(JOBS).where(JOBS.c.id == job.id).values(held))).rowcount:
                await connection.execute(JOBS.insert().values(id=job.id, created=job.created, tries=job.tries, **held))

    async def _claim(self, holder: str, now: int, held_until: int) -> Job | None:
        free = select(JOBS).where(JOBS.c.until < now).order_by(JOBS.c.created, JOBS.c.id).limit(1)
        async with self._engine.begin() as connection:
            row = (await connection.execute(free)).first()
            if row is None:
                return None
            mine = update(JOBS).where(JOBS.c.id == row.id, JOBS.c.until == row.until, JOBS.c.holder == row.holder)
            taken = await connection.execute(mine.values(holder=holder, until=held_until, tries=row.tries + 1))
        return Job(row.id, row.created, json.loads(row.details), row.tries + 1) if taken.rowcount else None

    async def _renew(self, holder: str, held_until: int) -> None:
        async with self._engine.begin() as connection:
            await connection.execute(update(JOBS).where(JOBS.c.holder == holder).values(until=held_until))

    async def _remove(self, job_id: str) -> None:
        async with self._engine.begin() as connection:
            await connection.execute(delete(JOBS).where(JOBS.c.id == job_id))
