from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest

from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import QuotaExceeded, Share, ShareScope


def make_share(number: int, subject: str = "aiko", expires: int = 1_000) -> Share:
    return Share(f"s{number}", number, expires, subject, session=f"session{number}")


async def test_links_are_stored_listed_and_removed(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    shares = catalogue.shares
    for share in (make_share(1), make_share(2, "ben"), make_share(3)):
        await shares.add(share)
    assert await shares.get("s2") == make_share(2, "ben")
    assert await shares.list(ShareScope(), 10) == [make_share(3), make_share(2, "ben"), make_share(1)]
    assert await shares.list(ShareScope("aiko"), 10) == [make_share(3), make_share(1)]
    assert await shares.list(ShareScope(), 1) == [make_share(3)]
    assert await shares.remove("s3")
    assert not await shares.remove("s3")
    assert await shares.get("s3") is None
    assert await shares.get("s") is None
    await catalogue.close()


async def test_adding_a_link_removes_expired_ones(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    await catalogue.shares.add(make_share(1, expires=50))
    await catalogue.shares.add(make_share(40))
    assert await catalogue.shares.get("s1") is not None
    await catalogue.shares.add(make_share(60))
    assert await catalogue.shares.get("s1") is None
    assert len(await catalogue.shares.list(ShareScope(), 10)) == 2
    await catalogue.close()


async def test_links_beyond_the_quota_of_their_subject_are_not_added(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    shares = catalogue.shares
    await shares.add(make_share(1, expires=50), 2)
    await shares.add(make_share(2), 2)
    with pytest.raises(QuotaExceeded, match="at most 2 links"):
        await shares.add(make_share(3), 2)
    assert await shares.get("s3") is None
    # another subject, no quota, after an expiry, after a revocation
    await shares.add(make_share(4, "ben"), 2)
    await shares.add(make_share(50), 2)
    with pytest.raises(QuotaExceeded):
        await shares.add(make_share(51), 2)
    await shares.remove("s2")
    await shares.add(make_share(52), 2)
    await shares.add(make_share(53))
    assert [share.id for share in await shares.list(ShareScope("aiko"), 10)] == ["s53", "s52", "s50"]
    await catalogue.close()


async def test_concurrent_links_of_several_replicas_do_not_exceed_the_quota(url: str) -> None:
    replicas = [await SqlCatalogue.open(url) for _ in range(3)]

    async def add(number: int) -> None:
        # under this load a slow database may exceed the time limit: try again
        with suppress(QuotaExceeded):
            while True:
                with suppress(BackendUnavailable):
                    await replicas[number % 3].shares.add(make_share(number, expires=10_000), 5)
                    return

    await asyncio.gather(*map(add, range(30)))
    assert len(await replicas[0].shares.list(ShareScope("aiko"), 50)) == 5
    for catalogue in replicas:
        await catalogue.close()
