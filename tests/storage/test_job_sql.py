"""Table of jobs, on SQLite and PostgreSQL."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import Job, JobHold


@pytest.fixture
async def catalogue(url: str) -> AsyncIterator[SqlCatalogue]:
    opened = await SqlCatalogue.open(url)
    yield opened
    await opened.close()


async def test_job_can_be_claimed_while_its_hold_is_unchanged(catalogue: SqlCatalogue) -> None:
    job = Job("j1", 5, {"kind": "motion", "filename": "踊り.bvh"})
    await catalogue.jobs.add(job, "one", 100)
    seen = JobHold("one", 100)
    assert await catalogue.jobs.list_holds(10) == {"j1": seen}
    await catalogue.jobs.renew("one", 300)
    assert await catalogue.jobs.claim("j1", seen, "two", 400) is None
    assert await catalogue.jobs.claim("j1", JobHold("one", 300), "two", 400) == Job("j1", 5, job.details, 1)
    # the former holder has lost the job
    await catalogue.jobs.renew("one", 900)
    assert await catalogue.jobs.claim("j1", JobHold("two", 400), "three", 500) == Job("j1", 5, job.details, 2)
    await catalogue.jobs.remove("j1")
    await catalogue.jobs.remove("j1")
    assert await catalogue.jobs.claim("j1", JobHold("three", 500), "three", 600) is None


async def test_adding_the_same_job_takes_it_over(catalogue: SqlCatalogue) -> None:
    await catalogue.jobs.add(Job("j1", 5, {"filename": "a"}), "one", 100)
    await catalogue.jobs.add(Job("j1", 9, {"filename": "b"}), "two", 200)
    assert await catalogue.jobs.claim("j1", JobHold("one", 100), "three", 300) is None
    assert await catalogue.jobs.claim("j1", JobHold("two", 200), "three", 300) == Job("j1", 5, {"filename": "b"}, 1)


async def test_concurrent_claims_give_each_job_to_one_replica(catalogue: SqlCatalogue) -> None:
    for number in range(3):
        await catalogue.jobs.add(Job(f"j{number}", 9 - number, {}), "failed", 100)
    holds = await catalogue.jobs.list_holds(2)
    assert list(holds) == ["j2", "j1"]
    claims = [
        catalogue.jobs.claim(job_id, hold, f"replica{number}", 1_000)
        for number in range(4)
        for job_id, hold in holds.items()
    ]
    assert sorted(job.id for job in await asyncio.gather(*claims) if job is not None) == ["j1", "j2"]
