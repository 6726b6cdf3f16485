from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack

import pytest

from bunraku.messaging import lease
from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.messaging.lease import hold_lease


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lease, "HEARTBEAT_INTERVAL_S", 0.05)
    monkeypatch.setattr(lease, "LEASE_TIMEOUT_S", 0.5)
    monkeypatch.setattr(lease, "POLL_INTERVAL_S", 0.01)


async def test_one_at_a_time_is_there_and_each_comes() -> None:
    register, inside, most, came = MemoryKeyValueStore(), 0, 0, []

    async def work(name: int) -> None:
        nonlocal inside, most
        async with hold_lease(register, "work"):
            inside += 1
            most = max(most, inside)
            # others get a chance to break in
            await asyncio.sleep(0.1)
            came.append(name)
            inside -= 1

    async with asyncio.timeout(20):
        await asyncio.gather(*map(work, range(5)))
    assert sorted(came) == list(range(5))
    assert most == 1
    assert await register.get("work") is None


async def test_who_stays_longer_than_a_lease_lasts_is_left_alone() -> None:
    register = MemoryKeyValueStore()
    async with AsyncExitStack() as stack:
        await stack.enter_async_context(hold_lease(register, "work"))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5), hold_lease(register, "work"):
                pytest.fail("two at once")
    async with asyncio.timeout(20), hold_lease(register, "work"):
        pass


async def test_who_is_gone_is_waited_for_no_longer_than_a_lease() -> None:
    register = MemoryKeyValueStore()
    await register.put("work", b"of one who died", 0)
    async with asyncio.timeout(20), hold_lease(register, "work"):
        found = await register.get("work")
        assert found is not None
        assert found.value != b"of one who died"
