from __future__ import annotations

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import Share


def make_share(number: int, subject: str = "aiko", expires: int = 1_000) -> Share:
    return Share(f"s{number}", number, expires, subject, session=f"session{number}")


async def test_links_are_stored_listed_and_removed(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    shares = catalogue.shares
    for share in (make_share(1), make_share(2, "ben"), make_share(3)):
        await shares.add(share)
    assert await shares.get("s2") == make_share(2, "ben")
    assert await shares.list(None, 10) == [make_share(3), make_share(2, "ben"), make_share(1)]
    assert await shares.list("aiko", 10) == [make_share(3), make_share(1)]
    assert await shares.list(None, 1) == [make_share(3)]
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
    assert len(await catalogue.shares.list(None, 10)) == 2
    await catalogue.close()
