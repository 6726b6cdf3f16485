from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bunraku.backing.catalogue import Catalogue, Entry
from bunraku.backing.unavailable import Unavailable


async def test_it_opens_once_at_its_first_use(url: str) -> None:
    catalogue = Catalogue(url)
    first, second = await asyncio.gather(catalogue.open(), catalogue.open())
    assert first is second
    assert await catalogue.add(Entry("m1", 1, {"a": 1}))
    assert await catalogue.get("m1") == Entry("m1", 1, {"a": 1})
    assert await catalogue.page(5) == ([Entry("m1", 1, {"a": 1})], None)
    assert await catalogue.remove("m1")
    await catalogue.close()


async def test_one_that_was_never_used_closes_too(tmp_path: Path) -> None:
    await Catalogue(f"sqlite:///{tmp_path}/c.sqlite").close()
    assert not (tmp_path / "c.sqlite").exists()


async def test_after_a_failure_it_tries_again(tmp_path: Path) -> None:
    catalogue = Catalogue(f"sqlite:///{tmp_path}/missing/c.sqlite")
    with pytest.raises(Unavailable, match="unable to open"):
        await catalogue.get("m1")
    await asyncio.to_thread((tmp_path / "missing").mkdir)
    assert await catalogue.get("m1") is None
    await catalogue.close()


def test_a_strange_address_is_refused() -> None:
    with pytest.raises(ValueError, match="sqlite"):
        Catalogue("mysql://somewhere")
