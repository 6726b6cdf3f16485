from __future__ import annotations

import asyncio
import base64
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any

import pytest
from sqlalchemy import update

from bunraku.runtime.problem import ProblemError
from bunraku.storage.catalogue_sql import DescriptionEdit, SqlCatalogue
from bunraku.storage.record import CatalogueEntry, InvalidCursor, MotionFilter
from bunraku.storage.table import MOTIONS


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


async def ids_of(catalogue: SqlCatalogue, search: str = "", tag: str = "") -> list[str]:
    entries, following = await catalogue.list_motions(50, None, MotionFilter(search, tag))
    assert following is None
    return sorted(entry.id for entry in entries)


async def test_search_finds_every_word_in_any_part_and_case(catalogue: SqlCatalogue) -> None:
    names = {"m1": "Der Kranich FLIEẞT", "m2": "ÇA VA, Größe 10%", "m3": "Ｋｒａｎｉｃｈ 人形", "m4": "а_б В100"}
    for number, (motion, name) in enumerate(names.items()):
        await catalogue.add_motion(CatalogueEntry(motion, number, {"name": name}))
    for search, expected in {
        "": ["m1", "m2", "m3", "m4"],
        "  ": ["m1", "m2", "m3", "m4"],
        "kranich": ["m1", "m3"],
        "FLIESST kran": ["m1"],
        "fließt der": ["m1"],
        "ça GRÖSSE": ["m2"],
        "C\u0327A": ["m2"],
        "人": ["m3"],
        "kranich 人形": ["m3"],
        "kranich wolf": [],
        "А_Б": ["m4"],
        # wildcards and the escape character of SQL are literal
        "%": ["m2"],
        "10%": ["m2"],
        "_": ["m4"],
        "/": [],
        "\\": [],
        "k%h": [],
        "' OR 1=1 --": [],
        "\0kranich\0": ["m1", "m3"],
        "\ud800": ["m1", "m2", "m3", "m4"],
    }.items():
        assert await ids_of(catalogue, search) == expected, search


async def test_tag_is_compared_as_a_whole_without_case(catalogue: SqlCatalogue) -> None:
    tags = {"m1": ["Walk", "at night"], "m2": ["walking"], "m3": ["ÜBUNG", "walk"], "m4": ["a%"], "m5": []}
    for number, (motion, each) in enumerate(tags.items()):
        await catalogue.add_motion(CatalogueEntry(motion, number, {"name": f"dance {number}", "tags": each}))
    await catalogue.add_motion(CatalogueEntry("m6", 9, {"name": "untagged"}))
    for tag, expected in {
        "WALK": ["m1", "m3"],
        "night": [],
        "At Night": ["m1"],
        "übung": ["m3"],
        "a%": ["m4"],
        "%": [],
        "\u200b": [],
        "walk\nat night": [],
    }.items():
        assert await ids_of(catalogue, tag=tag) == expected, tag
    assert await ids_of(catalogue, "2", "walk") == ["m3"]


async def test_pages_of_a_search_list_all_matches_while_the_library_changes(catalogue: SqlCatalogue) -> None:
    for number in range(9):
        name = "crane" if number % 2 else "fox"
        await catalogue.add_motion(CatalogueEntry(f"m{number}", number // 2, {"name": name}))
    condition = MotionFilter("CRANE")
    page, cursor = await catalogue.list_motions(2, None, condition)
    assert [entry.id for entry in page] == ["m7", "m5"]
    await catalogue.add_motion(CatalogueEntry("m9", 99, {"name": "crane"}))
    await catalogue.remove_motion("m5")
    page, cursor = await catalogue.list_motions(2, cursor, condition)
    assert ([entry.id for entry in page], cursor) == (["m3", "m1"], None)


async def test_row_of_an_older_replica_is_found(catalogue: SqlCatalogue) -> None:
    await catalogue.add_motion(CatalogueEntry("m1", 5, {"name": "Ärmel", "tags": ["Ö"]}))
    async with catalogue._engine.begin() as connection:
        await connection.execute(update(MOTIONS).values(folded_name=None, folded_tags=None))
    assert await ids_of(catalogue, "ärm") == ["m1"]
    assert await ids_of(catalogue, tag="ö") == ["m1"]


async def test_edit_changes_the_description_and_is_found(catalogue: SqlCatalogue) -> None:
    entry = CatalogueEntry("m1", 5, {"name": "old", "fps": 29.97}, "Aiko", 7)
    await catalogue.add_motion(entry)
    edited = await catalogue.edit_motion("m1", lambda one: {**one.description, "name": "Neu", "tags": ["T"]})
    assert edited == CatalogueEntry("m1", 5, {"name": "Neu", "fps": 29.97, "tags": ["T"]}, "Aiko", 7)
    assert await catalogue.get_motion("m1") == edited
    assert (await ids_of(catalogue, "neu"), await ids_of(catalogue, "old")) == (["m1"], [])
    assert await ids_of(catalogue, tag="t") == ["m1"]
    assert await catalogue.edit_motion("m2", lambda one: one.description) is None
    assert await catalogue.edit_motion("\0", lambda one: one.description) is None

    def reject(_: CatalogueEntry) -> dict[str, Any]:
        raise ProblemError(403, "Not allowed", "no")

    with pytest.raises(ProblemError, match="no"):
        await catalogue.edit_motion("m1", reject)
    assert await catalogue.get_motion("m1") == edited


async def test_size_of_a_replaced_object_is_stored(catalogue: SqlCatalogue) -> None:
    entry = CatalogueEntry("m1", 5, {"name": "x"}, "Aiko", 7)
    await catalogue.add_motion(entry)
    resized = await catalogue.edit_motion("m1", lambda one: one.description, object_bytes=3)
    assert resized == await catalogue.get_motion("m1") == replace(entry, bytes=3)
    assert await catalogue.edit_motion("m1", lambda one: one.description) == resized


async def test_concurrent_edits_are_all_applied(catalogue: SqlCatalogue) -> None:
    await catalogue.add_motion(CatalogueEntry("m1", 5, {"tags": []}))

    def add(tag: str) -> DescriptionEdit:
        return lambda entry: {**entry.description, "tags": [*entry.description["tags"], tag]}

    await asyncio.gather(*(catalogue.edit_motion("m1", add(str(number))) for number in range(8)))
    entry = await catalogue.get_motion("m1")
    assert entry is not None
    assert sorted(entry.description["tags"]) == [str(number) for number in range(8)]
