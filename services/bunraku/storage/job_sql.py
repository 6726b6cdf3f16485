"""SQL table of pending jobs: uploaded files that are not yet motions.

A replica holds a job until a clock time (microseconds) that it moves forward while it works. After that time any
replica may claim the job.
"""

from __future__ import annotations

import json

from sqlalchemy import delete, select, update
from sqlalchemy.ext.asyncio import AsyncEngine

from bunraku.storage.record import Job
from bunraku.storage.table import JOBS, QueryRunner, RemovalRunner


class SqlJobTable:
    """Table of jobs; `Catalogue` documents the methods."""

    def __init__(self, engine: AsyncEngine, run_query: QueryRunner, run_removal: RemovalRunner) -> None:
        self._engine = engine
        self._run_query = run_query
        self._run_removal = run_removal

    async def add(self, job: Job, holder: str, held_until: int) -> None:
        """Add a job, or take over the one of the same id."""
        await self._run_query(self._add(job, holder, held_until))

    async def claim(self, holder: str, now: int, held_until: int) -> Job | None:
        """Claim the oldest unheld job; return None if there is none, or another replica was faster."""
        return await self._run_query(self._claim(holder, now, held_until))

    async def renew(self, holder: str, held_until: int) -> None:
        """Extend the hold on all jobs of a replica."""
        await self._run_query(self._renew(holder, held_until))

    async def remove(self, job_id: str) -> None:
        """Remove a job."""
        await self._run_removal(lambda: self._remove(job_id))

    async def _add(self, job: Job, holder: str, held_until: int) -> None:
        values = {"details": json.dumps(job.details), "holder": holder, "until": held_until}
        async with self._engine.begin() as connection:
            if not (await connection.execute(update(JOBS).where(JOBS.c.id == job.id).values(values))).rowcount:
                await connection.execute(
                    JOBS.insert().values(id=job.id, created=job.created, tries=job.tries, **values)
                )

    async def _claim(self, holder: str, now: int, held_until: int) -> Job | None:
        oldest_unheld = select(JOBS).where(JOBS.c.until < now).order_by(JOBS.c.created, JOBS.c.id).limit(1)
        async with self._engine.begin() as connection:
            row = (await connection.execute(oldest_unheld)).first()
            if row is None:
                return None
            unchanged = update(JOBS).where(JOBS.c.id == row.id, JOBS.c.until == row.until, JOBS.c.holder == row.holder)
            claimed = await connection.execute(unchanged.values(holder=holder, until=held_until, tries=row.tries + 1))
        return Job(row.id, row.created, json.loads(row.details), row.tries + 1) if claimed.rowcount else None

    async def _renew(self, holder: str, held_until: int) -> None:
        async with self._engine.begin() as connection:
            await connection.execute(update(JOBS).where(JOBS.c.holder == holder).values(until=held_until))

    async def _remove(self, job_id: str) -> None:
        async with self._engine.begin() as connection:
            await connection.execute(delete(JOBS).where(JOBS.c.id == job_id))
