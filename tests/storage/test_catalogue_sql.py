from __future__ import annotations

import asyncio
import base64
from collections.abc import AsyncIterator

import pytest

from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.record import CatalogueEntry, InvalidCursor


@pytest.fixture
async def catalogue(url: str) -> AsyncIterator[SqlCatalogue]:
    opened = await SqlCatalogue.open(url)
    yield opened
    await opened.close()


async def test_motion_is_added_once_and_removed_once(catalogue: SqlCatalogue) -> None:
    entry = CatalogueEntry("m1", 5, {"name": "あ", "fps": 29.97, "guessed": ["cm"]})
    assert await catalogue.add_motion(entry)
    assert not await catalogue.add_motion(CatalogueEntry("m1", 6, {}))
    assert await catalogue.get_motion("m1") == entry
    assert await catalogue.get_motion("m2") is None
    assert await catalogue.remove_motion("m1")
    assert not await catalogue.remove_motion("m1")


async def test_pages_list_all_newest_first_with_equal_times(catalogue: SqlCatalogue) -> None:
    for number in range(7):
        await catalogue.add_motion(CatalogueEntry(f"m{number}", number // 2, {}))
    seen: list[str] = []
    cursor = None
    while True:
        page, cursor = await catalogue.list_motions(3, cursor)
        seen += [entry.id for entry in page]
        if cursor is None:
            break
    assert seen == ["m6", "m5", "m4", "m3", "m2", "m1", "m0"]


@pytest.mark.parametrize("cursor", ["", "x", "bm8=", "é", "Og==", "MTp4AA=="])
async def test_invalid_cursor_is_rejected(catalogue: SqlCatalogue, cursor: str) -> None:
    with pytest.raises(InvalidCursor):
        await catalogue.list_motions(3, cursor)


@pytest.mark.parametrize("motion", ["", "m\0", "m/1", "é", "m" * 100_000, "\ud800"])
async def test_malformed_id_is_not_found(catalogue: SqlCatalogue, motion: str) -> None:
    assert await catalogue.get_motion(motion) is None
    assert not await catalogue.remove_motion(motion)


@pytest.mark.parametrize("created", [-(10**30), 10**30])
async def test_cursor_beyond_the_integer_range_is_clamped(catalogue: SqlCatalogue, created: int) -> None:
    await catalogue.add_motion(CatalogueEntry("m1", 5, {}))
    cursor = base64.urlsafe_b64encode(f"{created}:x".encode()).decode()
    entries, following = await catalogue.list_motions(3, cursor)
    assert [entry.id for entry in entries] == (["m1"] if created > 0 else [])
    assert following is None


async def test_motion_persists_across_reopening(url: str) -> None:
    first = await SqlCatalogue.open(url)
    await first.add_motion(CatalogueEntry("m1", 5, {"a": 1}))
    await first.close()
    again = await SqlCatalogue.open(url)
    assert await again.get_motion("m1") == CatalogueEntry("m1", 5, {"a": 1})
    await again.close()


async def test_concurrent_adds_insert_one_motion(catalogue: SqlCatalogue) -> None:
    added = await asyncio.gather(*(catalogue.add_motion(CatalogueEntry("m1", number, {})) for number in range(30)))
    assert sum(added) == 1
    assert len((await catalogue.list_motions(5))[0]) == 1
