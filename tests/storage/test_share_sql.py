from __future__ import annotations

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import Share


def make_share(number: int, subject: str = "aiko", expires: int = 1_000) -> Share:
    return Share(f"s{number}", number, expires, subject, session=f"session{number}")


async def test_links_are_kept_listed_and_removed(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    kept = catalogue.shares
    for one in (make_share(1), make_share(2, "ben"), make_share(3)):
        await kept.add(one)
    assert await kept.get("s2") == make_share(2, "ben")
    assert await kept.list(None, 10) == [make_share(3), make_share(2, "ben"), make_share(1)]
    assert await kept.list("aiko", 10) == [make_share(3), make_share(1)]
    assert await kept.list(None, 1) == [make_share(3)]
    assert await kept.remove("s3")
    assert not await kept.remove("s3")
    assert await kept.get("s3") is None
    assert await kept.get("s") is None
    await catalogue.close()


async def test_what_has_expired_goes_when_another_comes(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    await catalogue.shares.add(make_share(1, expires=50))
    await catalogue.shares.add(make_share(40))
    assert await catalogue.shares.get("s1") is not None
    await catalogue.shares.add(make_share(60))
    assert await catalogue.shares.get("s1") is None
    assert len(await catalogue.shares.list(None, 10)) == 2
    await catalogue.close()
