"""Quotas of the catalogue, on SQLite and PostgreSQL."""

from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest
from sqlalchemy import text
from sqlalchemy.ext.asyncio import create_async_engine

from bunraku.backing.catalogue import Entry, Quota, QuotaUsedUp
from bunraku.backing.catalogue_sql import SqlCatalogue
from bunraku.backing.unavailable import Unavailable


def entry(name: str, subject: str = "aiko", size: int = 10) -> Entry:
    return Entry(name, 5, {}, subject, size)


@pytest.mark.parametrize(
    ("quota", "why"),
    [
        (Quota(motions=2), "you may keep 2 motions"),
        (Quota(bytes=20), "you may keep 20 bytes"),
        (Quota(total_motions=3), "this server keeps 3 motions"),
        (Quota(total_bytes=30), "this server keeps 30 bytes"),
    ],
)
async def test_one_too_many_is_refused_and_not_there(url: str, quota: Quota, why: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.add(entry("b1", "ben"), quota)
    assert await catalogue.add(entry("a1"), quota)
    await catalogue.check("aiko", quota)
    assert await catalogue.add(entry("a2"), quota)
    with pytest.raises(QuotaUsedUp, match=why):
        await catalogue.add(entry("a3"), quota)
    with pytest.raises(QuotaUsedUp, match=why):
        await catalogue.check("aiko", quota)
    assert await catalogue.get("a3") is None
    # what is known is no more than it was
    assert not await catalogue.add(entry("a2"), quota)
    assert await catalogue.remove("a1")
    assert await catalogue.add(entry("a3"), quota)
    assert await catalogue.get("a3") == entry("a3")
    await catalogue.close()


async def test_of_many_at_once_no_more_get_in_than_may(url: str) -> None:
    replicas = [await SqlCatalogue.open(url) for _ in range(3)]

    async def add(number: int) -> None:
        # of so many at once, some are told by a slow database that there was no answer in time, and come again
        with suppress(QuotaUsedUp):
            while True:
                with suppress(Unavailable):
                    await replicas[number % 3].add(entry(f"m{number}"), Quota(motions=5))
                    return

    await asyncio.gather(*map(add, range(20)))
    assert len((await replicas[0].page(50))[0]) == 5
    for catalogue in replicas:
        await catalogue.close()


async def test_a_replica_of_before_goes_on_beside_this_one(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    engine = create_async_engine(
        url.replace("sqlite:", "sqlite+aiosqlite:").replace("postgresql:", "postgresql+asyncpg:")
    )
    async with engine.begin() as connection:
        await connection.execute(text("INSERT INTO motions (id, created, description) VALUES ('old', 1, '{}')"))
    await engine.dispose()
    assert await catalogue.get("old") == Entry("old", 1, {})
    with pytest.raises(QuotaUsedUp):
        await catalogue.check("aiko", Quota(total_motions=1))
    await catalogue.close()
