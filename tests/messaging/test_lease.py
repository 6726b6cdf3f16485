from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack

import pytest

from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.messaging.lease import hold_lease, wait_until_abandoned
from bunraku.messaging.replica_registry import ReplicaRegistry, ReplicaTiming
from bunraku.runtime.availability import BackendUnavailable
from tests.time_limit import HANG_TIMEOUT_S
from tests.virtual_time import in_virtual_time

TIMING = ReplicaTiming(heartbeat_s=0.05, timeout_s=0.5)
POLL_S = 0.01


@in_virtual_time
async def test_holders_take_turns() -> None:
    store, active, max_active = MemoryKeyValueStore(), 0, 0
    finished: list[int] = []

    async def work(number: int) -> None:
        nonlocal active, max_active
        async with hold_lease(store, "work", TIMING, POLL_S):
            active += 1
            max_active = max(max_active, active)
            # long enough for others to try
            await asyncio.sleep(0.1)
            finished.append(number)
            active -= 1

    async with asyncio.timeout(HANG_TIMEOUT_S):
        await asyncio.gather(*map(work, range(5)))
    assert sorted(finished) == list(range(5))
    assert max_active == 1
    assert store.watch().entries == {}


@in_virtual_time
async def test_held_lease_outlasts_its_timeout() -> None:
    store = MemoryKeyValueStore()
    async with AsyncExitStack() as stack:
        await stack.enter_async_context(hold_lease(store, "work", TIMING, POLL_S))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5), hold_lease(store, "work", TIMING, POLL_S):
                pytest.fail("two holders at once")
    async with asyncio.timeout(HANG_TIMEOUT_S), hold_lease(store, "work", TIMING, POLL_S):
        pass


@pytest.mark.parametrize("holder", [b"dead", b"\xff\x00 token of an earlier release"])
@in_virtual_time
async def test_abandoned_lease_is_taken(holder: bytes) -> None:
    store = MemoryKeyValueStore()
    await store.put("work", holder, 0)
    async with asyncio.timeout(HANG_TIMEOUT_S), hold_lease(store, "work", TIMING, POLL_S):
        entry = await store.get("work")
        assert entry is not None
        assert entry.value != holder


@in_virtual_time
async def test_lease_whose_release_failed_ends_with_its_holder(monkeypatch: pytest.MonkeyPatch) -> None:
    store = MemoryKeyValueStore()
    remove = store.remove

    async def fail(key: str, revision: int | None = None) -> None:
        if key == "work":
            raise BackendUnavailable("the register", "no answer")
        await remove(key, revision)

    async with hold_lease(store, "work", TIMING, POLL_S):
        monkeypatch.setattr(store, "remove", fail)
    assert await store.get("work") is not None
    async with asyncio.timeout(HANG_TIMEOUT_S), hold_lease(store, "work", TIMING, POLL_S):
        pass


@in_virtual_time
async def test_lease_of_a_stalled_holder_is_taken_after_the_timeout() -> None:
    store, loop = MemoryKeyValueStore(), asyncio.get_running_loop()
    holder = ReplicaRegistry(store, TIMING)
    await store.put("work", (await holder.register()).encode(), 0)
    begin = loop.time()
    async with asyncio.timeout(HANG_TIMEOUT_S), hold_lease(store, "work", TIMING, POLL_S):
        assert loop.time() - begin > TIMING.timeout_s


@in_virtual_time
async def test_abandonment_is_noticed_while_the_holder_stays_registered() -> None:
    store = MemoryKeyValueStore()
    waiting = asyncio.create_task(wait_until_abandoned(store, "work", TIMING))
    async with hold_lease(store, "work", TIMING, POLL_S):
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.shield(waiting), 1.5)
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(asyncio.shield(waiting), 0.1)
    # a replica that is killed stays registered, without heartbeats
    killed = ReplicaRegistry(store, TIMING)
    await store.put("work", (await killed.register()).encode())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await waiting
    assert list(store.watch().entries) == [killed.key, "work"]
