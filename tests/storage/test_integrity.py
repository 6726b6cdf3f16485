"""Agreement of catalogue and object store after a crash."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from bunraku.storage import integrity
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.integrity import hide_incomplete_motions, sweep_objects
from bunraku.storage.motion_store import MotionStore
from bunraku.storage.record import CatalogueEntry, Job
from bunraku.storage.table import MOTIONS

OLD = 1_000_000_000.0


class Stored:
    """A catalogue and the store of its motions."""

    def __init__(self, folder: Path) -> None:
        self.library = folder / "library"
        self.catalogue = Catalogue(f"sqlite:///{folder}/catalogue.sqlite")
        self.motion_store = MotionStore.open(f"file://{self.library}")

    async def add(self, motion_id: str, created: int = 5, data: bytes = b"motion", recorded_bytes: int = 6) -> None:
        await self.motion_store.put(motion_id, data)
        assert await self.catalogue.add_motion(CatalogueEntry(motion_id, created, {}, "aiko", recorded_bytes))

    async def visible_ids(self) -> list[str]:
        return [entry.id for entry in (await self.catalogue.list_motions(50))[0]]

    async def check(self) -> int:
        return await hide_incomplete_motions(self.catalogue, self.motion_store)

    async def sweep(self, created_before: float) -> int:
        return await sweep_objects(self.catalogue, self.motion_store, created_before)

    def path(self, motion_id: str) -> Path:
        return self.library / "motions" / f"{motion_id}.bunraku"

    def file_names(self) -> set[str]:
        return {path.name for path in self.library.rglob("*") if path.is_file()}


@pytest.fixture
def stored(tmp_path: Path) -> Stored:
    return Stored(tmp_path)


async def test_motions_without_complete_objects_are_hidden(stored: Stored, caplog: pytest.LogCaptureFixture) -> None:
    for motion_id in ("whole", "missing", "short", "long", "unsized"):
        await stored.add(motion_id, recorded_bytes=0 if motion_id == "unsized" else 6)
    stored.path("missing").unlink()
    stored.path("short").write_bytes(b"mot")
    stored.path("long").write_bytes(b"motion and more")
    assert await stored.check() == 3
    assert sorted(await stored.visible_ids()) == ["unsized", "whole"]
    assert await stored.catalogue.get_motion("short") is None
    assert "Motion missing is hidden: its object is missing" in caplog.text
    assert "has 3 of 6 bytes" in caplog.text
    await stored.catalogue.close()


async def test_object_that_is_replaced_during_the_check_hides_nothing(
    stored: Stored, monkeypatch: pytest.MonkeyPatch
) -> None:
    await stored.add("m1")
    object_sizes = stored.motion_store.object_sizes

    async def replace_first(motion_ids: list[str]) -> list[int | None]:
        await stored.catalogue.edit_motion("m1", lambda one: one.description, object_bytes=0)
        await stored.motion_store.put("m1", b"less")
        return await object_sizes(motion_ids)

    monkeypatch.setattr(stored.motion_store, "object_sizes", replace_first)
    assert await stored.check() == 0
    await stored.catalogue.close()


async def test_restored_object_makes_its_motion_visible_again(stored: Stored) -> None:
    await stored.add("m1")
    stored.path("m1").unlink()
    assert await stored.check() == 1
    stored.path("m1").write_bytes(b"motion")
    assert await stored.check() == 0
    assert await stored.visible_ids() == ["m1"]
    await stored.catalogue.close()


async def test_repeated_upload_replaces_a_hidden_motion_on_all_replicas(stored: Stored, tmp_path: Path) -> None:
    await stored.add("m1")
    stored.path("m1").unlink()
    other = Stored(tmp_path)
    assert await stored.check() == await other.check() == 1
    await stored.add("m1", created=6)
    assert await stored.visible_ids() == await other.visible_ids() == ["m1"]
    await stored.catalogue.close()
    await other.catalogue.close()


async def test_truncated_object_is_never_served(stored: Stored) -> None:
    for length in range(60):
        stored.motion_store = MotionStore.open(f"file://{stored.library}")
        await stored.motion_store.put("m1", (b"\x82\xabdescription\xc4\x20" + bytes(32) + b"\xa6tracks\x91")[:length])
        assert await stored.motion_store.get("m1") is None


async def test_check_of_ten_thousand_rows_reads_pages(stored: Stored, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = await stored.catalogue.open()
    rows = [{"id": f"m{n}", "created": n, "description": "{}", "subject": "a", "bytes": 6} for n in range(10_000)]
    async with tables._engine.begin() as connection:
        await connection.execute(MOTIONS.insert(), rows)
    await stored.motion_store.put("m0", b"motion")
    for number in range(1, 9_999):
        os.link(stored.path("m0"), stored.path(f"m{number}"))
    pages: list[int] = []
    list_keys = stored.catalogue.list_motion_keys

    async def list_and_count(limit: int, after: str = "") -> list[object]:
        page = await list_keys(limit, after)
        pages.append(len(page))
        return list(page)

    monkeypatch.setattr(stored.catalogue, "list_motion_keys", list_and_count)
    assert await stored.check() == 1
    assert max(pages) == integrity.PAGE_SIZE
    assert sum(pages) == 10_000
    await stored.catalogue.close()


async def test_sweep_removes_what_nothing_refers_to(stored: Stored) -> None:
    await stored.add("kept")
    await stored.catalogue.add_job(Job("waiting", 1, {}), "a", 1 << 60)
    source = stored.library.with_name("source")
    source.write_bytes(b"file")
    for name in ("waiting", "dead"):
        await stored.motion_store.put_source(name, source)
    await stored.motion_store.put("orphan", b"motion")
    await stored.motion_store.put_log("log", b"log")
    await stored.motion_store.put_note("note", b"note")
    (stored.library / "motions" / "kept.bunraku#0123456789abcdef").write_bytes(b"mot")
    assert await stored.sweep(OLD) == 0
    os.utime(stored.path("kept"), (OLD - 1, OLD - 1))
    assert await stored.sweep(time.time() + 60) == 4
    assert stored.file_names() == {"kept.bunraku", "waiting", "note"}
    assert await stored.visible_ids() == ["kept"]
    await stored.catalogue.close()


async def test_library_of_another_catalogue_is_not_swept(stored: Stored, caplog: pytest.LogCaptureFixture) -> None:
    for number in range(integrity.MIN_FOREIGN_OBJECTS):
        await stored.motion_store.put(f"m{number}", b"motion")
    assert await stored.sweep(time.time() + 60) == 0
    assert "have no row in the catalogue" in caplog.text
    assert len(stored.file_names()) == integrity.MIN_FOREIGN_OBJECTS
    await stored.catalogue.close()
