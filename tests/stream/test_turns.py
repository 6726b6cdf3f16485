from __future__ import annotations

import asyncio

from bunraku.backing.backing import clock
from bunraku.stream.turns import MOST, Turns


class One:
    """Who counts their turns, and asks for the next."""

    def __init__(self, turns: Turns, again: int = 0) -> None:
        self.turns, self.again = turns, again
        self.times: list[int] = []
        self.done = asyncio.Event()

    def advance(self) -> None:
        self.times.append(clock())
        if len(self.times) <= self.again:
            self.turns.put(self, clock() + 1_000)
        else:
            self.done.set()


async def test_turns_come_again_and_again_and_never_early() -> None:
    turns = Turns()
    now = clock()
    ones = [One(turns, again=3) for _ in range(3 * MOST)]
    for nth, one in enumerate(ones):
        turns.put(one, now + nth * 300)
    async with asyncio.timeout(20):
        for one in ones:
            await one.done.wait()
    assert all(one.times[0] >= now + nth * 300 for nth, one in enumerate(ones))
    assert all(len(one.times) == 4 for one in ones)


async def test_a_nearer_turn_sets_the_timer_anew_and_one_removed_has_none() -> None:
    turns = Turns()
    far, near, removed = One(turns), One(turns), One(turns)
    turns.put(far, clock() + 3_600_000_000)
    turns.put(removed, clock() + 2_000)
    turns.put(near, clock() + 5_000)
    turns.remove(removed)
    async with asyncio.timeout(20):
        await near.done.wait()
    assert far.times == removed.times == []


async def test_whoever_else_waits_gets_in_between() -> None:
    turns = Turns()
    order: list[str] = []

    class Noted(One):
        def advance(self) -> None:
            super().advance()
            order.append("turn")

    ones = [Noted(turns) for _ in range(2 * MOST)]
    for one in ones:
        turns.put(one, 0)

    def note() -> None:
        order.append("other")
        if not ones[-1].done.is_set():
            asyncio.get_running_loop().call_soon(note)

    note()
    async with asyncio.timeout(20):
        for one in ones:
            await one.done.wait()
    assert "other" in order[order.index("turn") : len(order) - order[::-1].index("turn")]
