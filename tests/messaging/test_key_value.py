"""Behaviour common to all key-value stores: within one process, and over a real nats-server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value import KeyValueStore, MemoryKeyValueStore, RevisionConflict
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.runtime.availability import BackendUnavailable


@pytest.fixture(params=["memory", "nats"])
async def stores(request: pytest.FixtureRequest) -> AsyncIterator[tuple[KeyValueStore, KeyValueStore]]:
    """Return the store as two replicas use it."""
    if request.param == "memory":
        shared = MemoryKeyValueStore()
        yield shared, shared
        return
    url = request.getfixturevalue("nats_url")
    buses = NatsBus(url), NatsBus(url)
    for bus in buses:
        await bus.open()
    one, two = map(NatsKeyValueStore, buses)
    yield one, two
    await one.synchronise()
    for key in tuple(one.watch().entries):
        await one.remove(key)
    for store in (one, two):
        await store.close()
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


async def test_one_of_concurrent_writes_succeeds(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = stores
    revision = await one.put("sessions.a", b"0")
    outcomes = await asyncio.gather(
        *(store.put("sessions.a", b"x", revision) for store in (one, two) * 10), return_exceptions=True
    )
    assert sum(isinstance(outcome, int) for outcome in outcomes) == 1
    assert sum(isinstance(outcome, RevisionConflict) for outcome in outcomes) == 19


def collect_changes(store: KeyValueStore) -> list[tuple[str, bytes | None]]:
    changes: list[tuple[str, bytes | None]] = []
    store.watch().on_change(lambda key, entry: changes.append((key, None if entry is None else entry.value)))
    return changes


async def test_watch_has_a_snapshot_and_every_later_change(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = stores
    await one.put("sessions.before", b"1")
    await one.put("sessions.removed", b"2")
    await one.remove("sessions.removed")
    await two.synchronise()
    assert {key: entry.value for key, entry in two.watch().entries.items()} == {"sessions.before": b"1"}
    changes = collect_changes(two)
    assert changes == [("sessions.before", b"1")]
    expected = [(f"replicas.{number % 7}", b"%d" % number) for number in range(300)]
    for key, value in expected:
        last = await one.put(key, value)
    await one.remove("sessions.before")
    await two.synchronise()
    # with one revision of each key, changes in quick succession may be merged in order
    assert [change for change in expected if change in changes] == changes[1:-1]
    assert changes[-1] == ("sessions.before", None)
    view = two.watch()
    assert view.entries == {key: await one.get(key) for key in dict(expected)}
    assert view.entries[expected[-1][0]].revision == last < view.revision


async def test_failing_handler_of_changes_affects_no_other(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    store, _ = stores

    def fail(*_: object) -> None:
        raise ValueError("not a record")

    failing = store.watch().on_change(fail)
    changes = collect_changes(store)
    await store.put("sessions.a", b"1")
    await store.synchronise()
    failing.unsubscribe()
    assert changes == [("sessions.a", b"1")]


async def test_wait_for_a_later_revision_times_out(stores: tuple[KeyValueStore, KeyValueStore]) -> None:
    store, _ = stores
    revision = await store.put("sessions.a", b"1")
    await store.watch().wait_for(revision)
    with pytest.raises(BackendUnavailable):
        await store.watch().wait_for(revision + 1, timeout_s=0.01)
