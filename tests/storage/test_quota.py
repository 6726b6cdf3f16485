"""Quotas of the catalogue, on SQLite and PostgreSQL."""

from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest
from sqlalchemy import text
from sqlalchemy.ext.asyncio import create_async_engine

from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import CatalogueEntry, Quota, QuotaExceeded


def make_entry(name: str, subject: str = "aiko", size: int = 10) -> CatalogueEntry:
    return CatalogueEntry(name, 5, {}, subject, size)


@pytest.mark.parametrize(
    ("quota", "message"),
    [
        (Quota(max_motions=2), "you may store at most 2 motions"),
        (Quota(max_bytes=20), "you may store at most 20 bytes"),
        (Quota(max_total_motions=3), "this server stores at most 3 motions"),
        (Quota(max_total_bytes=30), "this server stores at most 30 bytes"),
    ],
)
async def test_motion_beyond_the_quota_is_not_added(url: str, quota: Quota, message: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.add_motion(make_entry("b1", "ben"), quota)
    assert await catalogue.add_motion(make_entry("a1"), quota)
    await catalogue.check_quota("aiko", quota)
    assert await catalogue.add_motion(make_entry("a2"), quota)
    with pytest.raises(QuotaExceeded, match=message):
        await catalogue.add_motion(make_entry("a3"), quota)
    with pytest.raises(QuotaExceeded, match=message):
        await catalogue.check_quota("aiko", quota)
    assert await catalogue.get_motion("a3") is None
    # a known motion does not count twice
    assert not await catalogue.add_motion(make_entry("a2"), quota)
    assert await catalogue.remove_motion("a1")
    assert await catalogue.add_motion(make_entry("a3"), quota)
    assert await catalogue.get_motion("a3") == make_entry("a3")
    await catalogue.close()


async def test_concurrent_adds_do_not_exceed_the_quota(url: str) -> None:
    replicas = [await SqlCatalogue.open(url) for _ in range(3)]

    async def add(number: int) -> None:
        # under this load a slow database may exceed the time limit: try again
        with suppress(QuotaExceeded):
            while True:
                with suppress(BackendUnavailable):
                    await replicas[number % 3].add_motion(make_entry(f"m{number}"), Quota(max_motions=5))
                    return

    await asyncio.gather(*map(add, range(20)))
    assert len((await replicas[0].list_motions(50))[0]) == 5
    for catalogue in replicas:
        await catalogue.close()


async def test_rows_of_an_older_replica_are_counted(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    engine = create_async_engine(
        url.replace("sqlite:", "sqlite+aiosqlite:").replace("postgresql:", "postgresql+asyncpg:")
    )
    async with engine.begin() as connection:
        await connection.execute(text("INSERT INTO motions (id, created, description) VALUES ('old', 1, '{}')"))
    await engine.dispose()
    assert await catalogue.get_motion("old") == CatalogueEntry("old", 1, {})
    with pytest.raises(QuotaExceeded):
        await catalogue.check_quota("aiko", Quota(max_total_motions=1))
    await catalogue.close()
