from __future__ import annotations

import asyncio

import pytest
from starlette.requests import Request

from bunraku.http.access_control import ACCESS_SCOPE_KEY, FULL_ACCESS, Access, Role
from bunraku.ik import resource_cache
from bunraku.ik.resource_cache import BUILD_BURST, BUILDS_PER_S, ResourceCache
from bunraku.runtime.problem import ProblemError


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def make_request(access: Access, address: str = "192.0.2.1") -> Request:
    return Request({"type": "http", "client": (address, 1), ACCESS_SCOPE_KEY: access})


LINK = Access(Role.VIEW, "share s1")


async def test_resource_is_built_once_for_concurrent_requests() -> None:
    cache, builds = ResourceCache(), list[str]()

    def build() -> bytes:
        builds.append("built")
        return b"table"

    found = await asyncio.gather(*(cache.get(make_request(FULL_ACCESS), "arm", build) for _ in range(5)))
    assert {one.data for one in found} == {b"table"}
    assert builds == ["built"]


async def test_least_recently_used_resource_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource_cache, "MAX_CACHED_RESOURCES", 2)
    cache, builds = ResourceCache(), list[str]()

    async def get(key: str) -> None:
        await cache.get(make_request(FULL_ACCESS), key, lambda: builds.append(key) or b"")  # type: ignore[func-returns-value]

    for key in ("a", "b", "a", "c", "a", "b"):
        await get(key)
    assert builds == ["a", "b", "c", "b"]


async def test_new_resources_are_limited_by_subject_and_address() -> None:
    clock = Clock()
    cache = ResourceCache(clock)
    flooder = make_request(LINK)
    for number in range(int(BUILD_BURST)):
        await cache.get(flooder, number, bytes)
    with pytest.raises(ProblemError, match="too many arms") as raised:
        await cache.get(flooder, "new", bytes)
    assert raised.value.status == 429
    # cached resources, another viewer of the same link, another subject, a later time
    await cache.get(flooder, 0, bytes)
    await cache.get(make_request(LINK, "192.0.2.2"), "second", bytes)
    await cache.get(make_request(Access(Role.VIEW, "aiko")), "third", bytes)
    clock.now = 1.0 / BUILDS_PER_S
    await cache.get(flooder, "new", bytes)


async def test_clients_of_a_server_without_a_secret_are_not_limited() -> None:
    cache = ResourceCache()
    for number in range(3 * int(BUILD_BURST)):
        await cache.get(make_request(FULL_ACCESS), number, bytes)
