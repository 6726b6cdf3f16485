"""Registry of live replicas on a clock that the tests advance."""

from __future__ import annotations

import asyncio

import pytest

from bunraku.messaging.key_value import KeyValueStore, MemoryKeyValueStore
from bunraku.messaging.replica_registry import (
    HEARTBEAT_INTERVAL_S,
    NO_REPLICA,
    REPLICA_REMOVAL_S,
    REPLICA_TIMEOUT_S,
    ReplicaRegistry,
)
from bunraku.runtime.availability import BackendUnavailable


class Clock:
    """Time of the event loop, which only `advance` changes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 1000.0
        monkeypatch.setattr(asyncio.get_running_loop(), "time", lambda: self.now_s)

    def advance(self, seconds: float) -> None:
        self.now_s += seconds


@pytest.fixture
async def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


async def beat(clock: Clock, rounds: int, *replicas: ReplicaRegistry) -> None:
    for _ in range(rounds):
        clock.advance(HEARTBEAT_INTERVAL_S)
        for replica in replicas:
            await replica.send_heartbeat()


async def test_replica_without_heartbeats_is_no_longer_alive(clock: Clock) -> None:
    store = MemoryKeyValueStore()
    one, two = ReplicaRegistry(store), ReplicaRegistry(store)
    await beat(clock, 2, two, one)
    assert one.is_alive(two.id)
    assert one.list_alive() == two.list_alive() == {one.id, two.id}
    await beat(clock, int(REPLICA_TIMEOUT_S), one)
    assert one.is_alive(two.id)
    await beat(clock, 1, one)
    assert not one.is_alive(two.id)
    assert one.list_alive() == {one.id}
    # its counter is removed in the end; when it is back it is alive again
    await beat(clock, int(REPLICA_REMOVAL_S), one)
    assert await store.get(two.key) is None
    await beat(clock, 1, two, one)
    assert one.is_alive(two.id)


async def test_unknown_replica_is_alive_only_with_a_counter(clock: Clock) -> None:
    store = MemoryKeyValueStore()
    one, two = ReplicaRegistry(store), ReplicaRegistry(store)
    # before the first heartbeat nothing is known
    assert one.is_alive("left")
    assert not one.is_alive(NO_REPLICA)
    with pytest.raises(BackendUnavailable):
        one.list_alive()
    await one.register()
    assert not one.is_alive("left")
    assert not one.is_alive(two.id)
    # after the last heartbeat of the observer
    await two.register()
    assert one.is_alive(two.id)
    assert two.id in one.list_alive()
    await two.close()
    await beat(clock, 1, one)
    assert not one.is_alive(two.id)


async def test_observer_that_was_cut_off_gives_others_their_time_again(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = MemoryKeyValueStore()
    one, two = ReplicaRegistry(store), ReplicaRegistry(store)
    await beat(clock, 2, one, two)
    put = store.put

    async def fail(*_: object) -> int:
        raise BackendUnavailable("the register", "no answer")

    monkeypatch.setattr(store, "put", fail)
    clock.advance(100.0)
    with pytest.raises(BackendUnavailable):
        await one.send_heartbeat()
    assert one.is_alive(two.id)
    monkeypatch.setattr(store, "put", put)
    await one.send_heartbeat()
    assert one.is_alive(two.id)
    await beat(clock, int(REPLICA_TIMEOUT_S) + 1, one)
    assert not one.is_alive(two.id)


async def test_late_watch_declares_nobody_dead(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    store = MemoryKeyValueStore()
    one, two = ReplicaRegistry(store), ReplicaRegistry(store)
    await beat(clock, 2, one, two)

    async def lag(*_: object) -> None:
        raise BackendUnavailable("the register", "the watch is late")

    monkeypatch.setattr(store.watch(), "wait_for", lag)
    for _ in range(10):
        clock.advance(HEARTBEAT_INTERVAL_S)
        with pytest.raises(BackendUnavailable):
            await one.send_heartbeat()
    assert one.is_alive(two.id)


async def test_clock_difference_between_machines_has_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counters hold no times: an observer whose clock is an hour ahead judges as the others do."""
    store: KeyValueStore = MemoryKeyValueStore()
    loop = asyncio.get_running_loop()
    one, two = ReplicaRegistry(store), ReplicaRegistry(store)
    now_s = loop.time()
    for number in range(8):
        for replica, difference_s in ((one, 0.0), (two, 3600.0)):
            monkeypatch.setattr(loop, "time", lambda at=now_s + number + difference_s: at)
            await replica.send_heartbeat()
        assert one.list_alive() == two.list_alive() == {one.id, two.id}
