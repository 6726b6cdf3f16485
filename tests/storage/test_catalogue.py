from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import CatalogueEntry


async def test_concurrent_first_uses_open_once(url: str) -> None:
    catalogue = Catalogue(url)
    first, second = await asyncio.gather(catalogue.open(), catalogue.open())
    assert first is second
    assert await catalogue.add_motion(CatalogueEntry("m1", 1, {"a": 1}))
    assert await catalogue.get_motion("m1") == CatalogueEntry("m1", 1, {"a": 1})
    assert await catalogue.list_motions(5) == ([CatalogueEntry("m1", 1, {"a": 1})], None)
    assert await catalogue.remove_motion("m1")
    await catalogue.close()


async def test_unused_catalogue_closes_without_opening(tmp_path: Path) -> None:
    await Catalogue(f"sqlite:///{tmp_path}/c.sqlite").close()
    assert not (tmp_path / "c.sqlite").exists()


async def test_failed_open_is_tried_again(tmp_path: Path) -> None:
    catalogue = Catalogue(f"sqlite:///{tmp_path}/missing/c.sqlite")
    with pytest.raises(BackendUnavailable, match="unable to open"):
        await catalogue.get_motion("m1")
    await asyncio.to_thread((tmp_path / "missing").mkdir)
    assert await catalogue.get_motion("m1") is None
    await catalogue.close()


def test_unknown_url_scheme_is_rejected() -> None:
    with pytest.raises(ValueError, match="sqlite"):
        Catalogue("mysql://somewhere")
