"""The table of jobs, on SQLite and PostgreSQL."""

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


async def test_a_job_is_its_holders_until_its_time_is_over(catalogue: SqlCatalogue) -> None:
    job = Job("j1", 5, {"kind": "motion", "filename": "踊り.bvh"})
    await catalogue.jobs.add(job, "one", 100)
    assert await catalogue.jobs.claim("two", 50, 200) is None
    await catalogue.jobs.renew("one", 300)
    assert await catalogue.jobs.claim("two", 200, 400) is None
    assert await catalogue.jobs.claim("two", 301, 400) == Job("j1", 5, job.details, 1)
    # it is another's now
    await catalogue.jobs.renew("one", 900)
    assert await catalogue.jobs.claim("three", 401, 500) == Job("j1", 5, job.details, 2)
    await catalogue.jobs.remove("j1")
    await catalogue.jobs.remove("j1")
    assert await catalogue.jobs.claim("three", 10_000, 20_000) is None


async def test_who_sends_the_same_again_has_the_job(catalogue: SqlCatalogue) -> None:
    await catalogue.jobs.add(Job("j1", 5, {"filename": "a"}), "one", 100)
    await catalogue.jobs.add(Job("j1", 9, {"filename": "b"}), "two", 200)
    assert await catalogue.jobs.claim("three", 150, 300) is None
    assert await catalogue.jobs.claim("three", 250, 300) == Job("j1", 5, {"filename": "b"}, 1)


async def test_the_oldest_is_first_and_of_many_who_ask_at_once_one_has_it(catalogue: SqlCatalogue) -> None:
    for number in range(3):
        await catalogue.jobs.add(Job(f"j{number}", 9 - number, {}), "gone", 100)
    asked = [catalogue.jobs.claim(f"replica{number}", 101, 1_000) for number in range(6)]
    found = [job.id for job in await asyncio.gather(*asked) if job is not None]
    assert len(found) == len(set(found))
    while (job := await catalogue.jobs.claim("last", 102, 1_000)) is not None:
        found.append(job.id)
    assert sorted(found) == ["j0", "j1", "j2"]
