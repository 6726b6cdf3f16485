"""SQL table of pending jobs: uploaded files that are not yet motions.

A replica that works on a job changes the number `until` of its hold again and again. Who has seen the same hold for a
while may claim the job; a released job at once. `until` is a clock time (microseconds) after which replicas of earlier
releases claim the job.
"""

from __future__ import annotations

import json

from sqlalchemy import and_, delete, select, update
from sqlalchemy.ext.asyncio import AsyncEngine

from bunraku.storage.record import Job, JobHold
from bunraku.storage.table import JOBS, QueryRunner


class SqlJobTable:
    """Table of jobs; `Catalogue` documents the methods."""

    def __init__(self, engine: AsyncEngine, run_query: QueryRunner) -> None:
        self._engine = engine
        self._run_query = run_query

    async def add(self, job: Job, holder: str, held_until: int) -> None:
        """Add a job, or take over the one of the same id."""
        await self._run_query(self._add(job, holder, held_until))

    async def list_holds(self, limit: int) -> dict[str, JobHold]:
        """Return the holds of the oldest jobs by id, oldest first."""
        return await self._run_query(self._list_holds(limit))

    async def claim(self, job_id: str, hold: JobHold, holder: str, held_until: int) -> Job | None:
        """Claim a job that still has this hold; return None if it is removed, or its hold has changed."""
        return await self._run_query(self._claim(job_id, hold, holder, held_until))

    async def renew(self, holder: str, held_until: int) -> None:
        """Extend the hold on all jobs of a replica."""
        await self._run_query(self._renew(holder, held_until))

    async def remove(self, job_id: str) -> None:
        """Remove a job."""
        await self._run_query(self._remove(job_id))

    async def _add(self, job: Job, holder: str, held_until: int) -> None:
        values = {"details": json.dumps(job.details), "holder": holder, "until": held_until}
        async with self._engine.begin() as connection:
            if not (await connection.execute(update(JOBS).where(JOBS.c.id == job.id).values(values))).rowcount:
                await connection.execute(
                    JOBS.insert().values(id=job.id, created=job.created, tries=job.tries, **values)
                )

    async def _list_holds(self, limit: int) -> dict[str, JobHold]:
        oldest = select(JOBS.c.id, JOBS.c.holder, JOBS.c.until).order_by(JOBS.c.created, JOBS.c.id).limit(limit)
        async with self._engine.connect() as connection:
            return {row.id: JobHold(row.holder, row.until) for row in await connection.execute(oldest)}

    async def _claim(self, job_id: str, hold: JobHold, holder: str, held_until: int) -> Job | None:
        unchanged = and_(JOBS.c.id == job_id, JOBS.c.until == hold.until, JOBS.c.holder == hold.holder)
        async with self._engine.begin() as connection:
            row = (await connection.execute(select(JOBS).where(unchanged))).first()
            if row is None:
                return None
            claim = update(JOBS).where(unchanged, JOBS.c.tries == row.tries)
            claimed = await connection.execute(claim.values(holder=holder, until=held_until, tries=row.tries + 1))
        return Job(row.id, row.created, json.loads(row.details), row.tries + 1) if claimed.rowcount else None

    async def _renew(self, holder: str, held_until: int) -> None:
        async with self._engine.begin() as connection:
            await connection.execute(update(JOBS).where(JOBS.c.holder == holder).values(until=held_until))

    async def _remove(self, job_id: str) -> None:
        async with self._engine.begin() as connection:
            await connection.execute(delete(JOBS).where(JOBS.c.id == job_id))
