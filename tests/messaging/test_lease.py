from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack

import pytest

from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.messaging.lease import LeaseTiming, hold_lease

TIMING = LeaseTiming(heartbeat_s=0.05, timeout_s=0.5, poll_s=0.01)


async def test_holders_take_turns() -> None:
    store, active, max_active = MemoryKeyValueStore(), 0, 0
    finished: list[int] = []

    async def work(number: int) -> None:
        nonlocal active, max_active
        async with hold_lease(store, "work", TIMING):
            active += 1
            max_active = max(max_active, active)
            # long enough for others to try
            await asyncio.sleep(0.1)
            finished.append(number)
            active -= 1

    async with asyncio.timeout(20):
        await asyncio.gather(*map(work, range(5)))
    assert sorted(finished) == list(range(5))
    assert max_active == 1
    assert await store.get("work") is None


async def test_renewed_lease_outlasts_its_timeout() -> None:
    store = MemoryKeyValueStore()
    async with AsyncExitStack() as stack:
        await stack.enter_async_context(hold_lease(store, "work", TIMING))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5), hold_lease(store, "work", TIMING):
                pytest.fail("two holders at once")
    async with asyncio.timeout(20), hold_lease(store, "work", TIMING):
        pass


async def test_abandoned_lease_is_taken_after_its_timeout() -> None:
    store, now = MemoryKeyValueStore(), 0.0

    def clock() -> float:
        nonlocal now
        now += 1.0
        return now

    await store.put("work", b"of a dead holder", 0)
    timing = LeaseTiming(heartbeat_s=0.05, timeout_s=5.0, poll_s=0.0, clock=clock)
    async with asyncio.timeout(20), hold_lease(store, "work", timing):
        entry = await store.get("work")
        assert entry is not None
        assert entry.value != b"of a dead holder"
    # one reading at the start, one at the first sight of the revision, then more than 5 s without a change
    assert now == 8.0
