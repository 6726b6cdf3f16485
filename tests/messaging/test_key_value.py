"""Behaviour common to all key-value stores: within one process, and over a real nats-server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value import KeyValueStore, MemoryKeyValueStore, RevisionConflict
from bunraku.messaging.key_value_nats import NatsKeyValueStore


@pytest.fixture(params=["memory", "nats"])
async def stores(request: pytest.FixtureRequest) -> AsyncIterator[tuple[KeyValueStore, KeyValueStore]]:
    """Return the store as two replicas use it."""
    if request.param == "memory":
        store = MemoryKeyValueStore()
        yield store, store
        return
    url = request.getfixturevalue("nats_url")
    buses = NatsBus(url), NatsBus(url)
    for bus in buses:
        await bus.open()
    one, two = map(NatsKeyValueStore, buses)
    yield one, two
    for prefix in ("sessions", "replicas", "sessionsc"):
        for key in await one.list_prefix(prefix):
            await one.remove(key)
    for bus in buses:
        await bus.close()


async def test_write_with_an_old_revision_conflicts(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = stores
    assert await one.get("sessions.a") is None
    first = await one.put("sessions.a", b"1", 0)
    with pytest.raises(RevisionConflict):
        await two.put("sessions.a", b"2", 0)
    second = await two.put("sessions.a", b"2", first)
    assert second > first
    for outdated in (one.put("sessions.a", b"3", first), one.remove("sessions.a", first)):
        with pytest.raises(RevisionConflict):
            await outdated
    entry = await one.get("sessions.a")
    assert entry is not None
    assert (entry.value, entry.revision) == (b"2", second)
    third = await two.put("sessions.a", b"4")
    await one.remove("sessions.a", third)
    assert await two.get("sessions.a") is None
    await one.remove("sessions.a")
    assert await two.put("sessions.a", b"", 0) > third
    empty = await one.get("sessions.a")
    assert empty is not None
    assert empty.value == b""


async def test_keys_are_listed_by_prefix(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = stores
    assert await two.list_prefix("sessions") == {}
    for key in ("sessions.b-_1", "replicas.b", "sessions.a", "sessions.removed", "sessionsc.a"):
        await one.put(key, key.encode())
    await two.put("sessions.b-_1", b"new")
    await one.remove("sessions.removed")
    entries = await two.list_prefix("sessions")
    assert {key: entry.value for key, entry in entries.items()} == {
        "sessions.b-_1": b"new",
        "sessions.a": b"sessions.a",
    }
    assert entries["sessions.a"] == await one.get("sessions.a")


async def test_one_of_concurrent_writes_succeeds(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = stores
    revision = await one.put("sessions.a", b"0")
    outcomes = await asyncio.gather(
        *(store.put("sessions.a", b"x", revision) for store in (one, two) * 10), return_exceptions=True
    )
    assert sum(isinstance(outcome, int) for outcome in outcomes) == 1
    assert sum(isinstance(outcome, RevisionConflict) for outcome in outcomes) == 19
