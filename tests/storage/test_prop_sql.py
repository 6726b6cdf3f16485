from __future__ import annotations

import asyncio

import pytest

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import InvalidCursor, PropQuota, QuotaExceeded, StoredProp

UNLIMITED = PropQuota()


def make_prop(number: int, subject: str = "aiko") -> StoredProp:
    return StoredProp(f"p{number}", number, {"name": f"prop {number}"}, subject)


async def test_props_are_stored_listed_and_removed(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    props = catalogue.props
    for number in range(1, 6):
        assert await props.add(make_prop(number), b"model %d" % number, UNLIMITED)
    assert await props.get("p2") == make_prop(2)
    assert await props.get_model("p2") == b"model 2"
    first, cursor = await props.list(2)
    assert [prop.id for prop in first] == ["p5", "p4"]
    assert cursor is not None
    assert await props.remove("p3")
    second, following = await props.list(2, cursor)
    assert ([prop.id for prop in second], following) == (["p2", "p1"], None)
    assert not await props.remove("p3")
    assert await props.get("p3") is None
    assert await props.get_model("p3") is None
    with pytest.raises(InvalidCursor):
        await props.list(2, "x")
    await catalogue.close()


@pytest.mark.parametrize("prop_id", ["", "a/b", "\0", "é", "x" * 65])
async def test_texts_that_are_no_ids_name_no_prop(url: str, prop_id: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.props.get(prop_id) is None
    assert await catalogue.props.get_model(prop_id) is None
    assert not await catalogue.props.remove(prop_id)
    await catalogue.close()


async def test_same_prop_is_added_once_and_stays_as_it_is(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.props.add(make_prop(1), b"model", PropQuota(1, 1))
    assert not await catalogue.props.add(make_prop(1, "ben"), b"other", PropQuota(1, 1))
    assert await catalogue.props.get("p1") == make_prop(1)
    assert await catalogue.props.get_model("p1") == b"model"
    await catalogue.close()


async def test_props_beyond_a_quota_are_not_added(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    props, quota = catalogue.props, PropQuota(2, 3)
    for number in (1, 2):
        await props.add(make_prop(number), b"", quota)
    with pytest.raises(QuotaExceeded, match="you may store at most 2 props"):
        await props.add(make_prop(3), b"", quota)
    with pytest.raises(QuotaExceeded, match="you may store"):
        await props.check_quota("aiko", quota)
    await props.check_quota("ben", quota)
    await props.add(make_prop(4, "ben"), b"", quota)
    with pytest.raises(QuotaExceeded, match="this server stores at most 3 props"):
        await props.add(make_prop(5, "ben"), b"", quota)
    assert await props.get("p3") is None
    await props.remove("p1")
    await props.add(make_prop(6), b"", quota)
    assert [prop.id for prop in (await props.list(10))[0]] == ["p6", "p4", "p2"]
    await catalogue.close()


async def test_concurrent_additions_keep_the_quota(url: str) -> None:
    catalogue = await SqlCatalogue.open(url)
    additions = (catalogue.props.add(make_prop(number), b"", PropQuota(3)) for number in range(8))
    results = await asyncio.gather(*additions, return_exceptions=True)
    assert sum(isinstance(result, QuotaExceeded) for result in results) == 5
    assert len((await catalogue.props.list(10))[0]) == 3
    await catalogue.close()
