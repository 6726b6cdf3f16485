from __future__ import annotations

import asyncio

import pytest

from bunraku.ingest.props.model_cache import MAX_AGE_S, MAX_CACHED_MODELS, ModelCache


class Shelf:
    """Models by id, with the ids that were asked for; None and errors are not models."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.is_away = False

    async def load(self, prop: str) -> bytes | None:
        self.asked.append(prop)
        await asyncio.sleep(0)
        if self.is_away:
            raise OSError("away")
        return None if prop == "none" else prop.encode()


async def test_waiting_requests_share_one_query() -> None:
    shelf = Shelf()
    cache = ModelCache(shelf.load)
    assert await asyncio.gather(*(cache.get(prop) for prop in ["a"] * 50 + ["b"])) == [b"a"] * 50 + [b"b"]
    assert sorted(shelf.asked) == ["a", "b"]


async def test_missing_and_failed_models_are_asked_for_again() -> None:
    shelf = Shelf()
    cache = ModelCache(shelf.load)
    assert await cache.get("none") is None
    shelf.is_away = True
    with pytest.raises(OSError, match="away"):
        await cache.get("a")
    shelf.is_away = False
    assert await cache.get("none") is None
    assert await cache.get("a") == b"a"
    assert shelf.asked == ["none", "a", "none", "a"]


async def test_least_recently_wanted_model_makes_room() -> None:
    shelf = Shelf()
    cache = ModelCache(shelf.load)
    names = [str(number) for number in range(MAX_CACHED_MODELS)]
    for name in [*names, "0", "more", "0", "1"]:
        await cache.get(name)
    assert shelf.asked == [*names, "more", "1"]


async def test_forgotten_model_is_asked_for_again() -> None:
    shelf = Shelf()
    cache = ModelCache(shelf.load)
    await cache.get("a")
    cache.forget("a")
    cache.forget("b")
    await cache.get("a")
    assert shelf.asked == ["a", "a"]


async def test_old_model_is_asked_for_again_as_another_replica_may_have_removed_it() -> None:
    shelf, now = Shelf(), [0.0]
    removed = False

    async def load(prop: str) -> bytes | None:
        return None if removed else await shelf.load(prop)

    cache = ModelCache(load, lambda: now[0])
    await cache.get("a")
    now[0] = MAX_AGE_S
    assert await cache.get("a") == b"a"
    assert shelf.asked == ["a"]
    now[0] += 1.0
    assert await cache.get("a") == b"a"
    assert shelf.asked == ["a", "a"]
    removed = True
    now[0] += MAX_AGE_S + 1.0
    assert await cache.get("a") is None
