from __future__ import annotations

import asyncio

from bunraku.runtime.clock import clock
from bunraku.stream.tick_scheduler import MAX_BATCH, TickScheduler
from tests.time_limit import HANG_TIMEOUT_S


class CountingItem:
    """Item that records its ticks and schedules the next one."""

    def __init__(self, scheduler: TickScheduler, repeats: int = 0) -> None:
        self.scheduler, self.repeats = scheduler, repeats
        self.times: list[int] = []
        self.done = asyncio.Event()

    def tick(self) -> None:
        self.times.append(clock())
        if len(self.times) <= self.repeats:
            self.scheduler.schedule(self, clock() + 1_000)
        else:
            self.done.set()


async def test_ticks_repeat_and_are_never_early() -> None:
    scheduler = TickScheduler(clock)
    now = clock()
    items = [CountingItem(scheduler, repeats=3) for _ in range(3 * MAX_BATCH)]
    for nth, item in enumerate(items):
        scheduler.schedule(item, now + nth * 300)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        for item in items:
            await item.done.wait()
    assert all(item.times[0] >= now + nth * 300 for nth, item in enumerate(items))
    assert all(len(item.times) == 4 for item in items)


async def test_earlier_tick_resets_timer_and_cancelled_item_has_no_tick() -> None:
    scheduler = TickScheduler(clock)
    far, near, cancelled = CountingItem(scheduler), CountingItem(scheduler), CountingItem(scheduler)
    scheduler.schedule(far, clock() + 3_600_000_000)
    scheduler.schedule(cancelled, clock() + 2_000)
    scheduler.schedule(near, clock() + 5_000)
    scheduler.cancel(cancelled)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await near.done.wait()
    assert far.times == cancelled.times == []


async def test_other_callbacks_run_between_batches() -> None:
    scheduler = TickScheduler(clock)
    order: list[str] = []

    class RecordingItem(CountingItem):
        def tick(self) -> None:
            super().tick()
            order.append("tick")

    items = [RecordingItem(scheduler) for _ in range(2 * MAX_BATCH)]
    for item in items:
        scheduler.schedule(item, 0)

    def run_other() -> None:
        order.append("other")
        if not items[-1].done.is_set():
            asyncio.get_running_loop().call_soon(run_other)

    run_other()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        for item in items:
            await item.done.wait()
    assert "other" in order[order.index("tick") : len(order) - order[::-1].index("tick")]
