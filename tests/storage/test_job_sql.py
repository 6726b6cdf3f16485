"""Table of jobs, on SQLite and PostgreSQL."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import Job


@pytest.fixture
async def catalogue(url: str) -> AsyncIterator[SqlCatalogue]:
    opened = await SqlCatalogue.open(url)
    yield opened
    await opened.close()


async def test_job_can_be_claimed_after_its_hold_expires(catalogue: SqlCatalogue) -> None:
    job = Job("j1", 5, {"kind": "motion", "filename": "踊り.bvh"})
    await catalogue.jobs.add(job, "one", 100)
    assert await catalogue.jobs.claim("two", 50, 200) is None
    await catalogue.jobs.renew("one", 300)
    assert await catalogue.jobs.claim("two", 200, 400) is None
    assert await catalogue.jobs.claim("two", 301, 400) == Job("j1", 5, job.details, 1)
    # the former holder has lost the job
    await catalogue.jobs.renew("one", 900)
    assert await catalogue.jobs.claim("three", 401, 500) == Job("j1", 5, job.details, 2)
    await catalogue.jobs.remove("j1")
    await catalogue.jobs.remove("j1")
    assert await catalogue.jobs.claim("three", 10_000, 20_000) is None


async def test_adding_the_same_job_takes_it_over(catalogue: SqlCatalogue) -> None:
    await catalogue.jobs.add(Job("j1", 5, {"filename": "a"}), "one", 100)
    await catalogue.jobs.add(Job("j1", 9, {"filename": "b"}), "two", 200)
    assert await catalogue.jobs.claim("three", 150, 300) is None
    assert await catalogue.jobs.claim("three", 250, 300) == Job("j1", 5, {"filename": "b"}, 1)


async def test_concurrent_claims_give_each_job_to_one_replica(catalogue: SqlCatalogue) -> None:
    for number in range(3):
        await catalogue.jobs.add(Job(f"j{number}", 9 - number, {}), "failed", 100)
    claims = [catalogue.jobs.claim(f"replica{number}", 101, 1_000) for number in range(6)]
    claimed = [job.id for job in await asyncio.gather(*claims) if job is not None]
    assert len(claimed) == len(set(claimed))
    while (job := await catalogue.jobs.claim("last", 102, 1_000)) is not None:
        claimed.append(job.id)
    assert sorted(claimed) == ["j0", "j1", "j2"]
