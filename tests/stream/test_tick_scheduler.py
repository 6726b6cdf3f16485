from __future__ import annotations

import asyncio

from bunraku.runtime.clock import clock
from bunraku.stream.tick_scheduler import MAX_BATCH, TickScheduler


class CountingItem:
    """Who counts their turns, and asks for the next."""

    def __init__(self, turns: TickScheduler, again: int = 0) -> None:
        self.scheduler, self.repeats = turns, again
        self.times: list[int] = []
        self.done = asyncio.Event()

    def tick(self) -> None:
        self.times.append(clock())
        if len(self.times) <= self.repeats:
            self.scheduler.schedule(self, clock() + 1_000)
        else:
            self.done.set()


async def test_turns_come_again_and_again_and_never_early() -> None:
    turns = TickScheduler()
    now = clock()
    ones = [CountingItem(turns, again=3) for _ in range(3 * MAX_BATCH)]
    for nth, one in enumerate(ones):
        turns.schedule(one, now + nth * 300)
    async with asyncio.timeout(20):
        for one in ones:
            await one.done.wait()
    assert all(one.times[0] >= now + nth * 300 for nth, one in enumerate(ones))
    assert all(len(one.times) == 4 for one in ones)


async def test_a_nearer_turn_sets_the_timer_anew_and_one_removed_has_none() -> None:
    turns = TickScheduler()
    far, near, removed = CountingItem(turns), CountingItem(turns), CountingItem(turns)
    turns.schedule(far, clock() + 3_600_000_000)
    turns.schedule(removed, clock() + 2_000)
    turns.schedule(near, clock() + 5_000)
    turns.cancel(removed)
    async with asyncio.timeout(20):
        await near.done.wait()
    assert far.times == removed.times == []


async def test_whoever_else_waits_gets_in_between() -> None:
    turns = TickScheduler()
    order: list[str] = []

    class Noted(CountingItem):
        def advance(self) -> None:
            super().tick()
            order.append("turn")

    ones = [Noted(turns) for _ in range(2 * MAX_BATCH)]
    for one in ones:
        turns.schedule(one, 0)

    def note() -> None:
        order.append("other")
        if not ones[-1].done.is_set():
            asyncio.get_running_loop().call_soon(note)

    note()
    async with asyncio.timeout(20):
        for one in ones:
            await one.done.wait()
    assert "other" in order[order.index("turn") : len(order) - order[::-1].index("turn")]
