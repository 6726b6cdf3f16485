from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from bunraku.client import asking
from bunraku.client.asking import BURST, UNANSWERED, Asking
from bunraku.wire.messages import Ping, Report, unpack

FARES = Report(3_000_000, 400)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asking, "BURST_EVERY", 0.0)
    monkeypatch.setattr(asking, "ASK_EVERY", 0.0)


class Said:
    """What was said, one after the other."""

    def __init__(self) -> None:
        self._queue: asyncio.Queue[bytes] = asyncio.Queue()

    async def send(self, message: bytes) -> None:
        self._queue.put_nowait(message)

    async def next(self) -> Ping | Report:
        message = unpack(await self._queue.get())
        assert isinstance(message, Ping | Report)
        return message

    async def ping(self) -> Ping:
        while not isinstance(message := await self.next(), Ping):
            pass
        return message

    @property
    def empty(self) -> bool:
        return self._queue.empty()


@asynccontextmanager
async def running() -> AsyncIterator[tuple[Asking, Said]]:
    said, now = Said(), iter(range(1_000_000))
    made = Asking(said.send, lambda: next(now), lambda: FARES)
    made.begin()
    task = asyncio.create_task(made.run())
    try:
        yield made, said
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def passes() -> None:
    """So many turns of the loop that what is not held back would have been said."""
    for _ in range(50):
        await asyncio.sleep(0)


async def test_it_asks_and_after_the_first_few_tells_too_how_it_fares() -> None:
    async with running() as (made, said):
        for sequence in range(BURST):
            assert await said.next() == Ping(sequence, sequence)
            made.answered(sequence)
        assert await said.next() == Ping(BURST, BURST)
        assert await said.next() == FARES


async def test_while_what_it_asked_is_not_answered_it_says_no_more() -> None:
    async with running() as (made, said):
        assert [(await said.ping()).sequence for _ in range(UNANSWERED)] == [0, 1]
        await passes()
        assert said.empty
        made.answered(0)
        assert (await said.ping()).sequence == 2
        await passes()
        assert said.empty
        # an answer says that those before it have nothing to wait for either
        made.answered(2)
        assert [(await said.ping()).sequence for _ in range(UNANSWERED)] == [3, 4]


async def test_over_a_new_line_it_asks_anew_and_what_the_old_one_owes_is_forgotten() -> None:
    async with running() as (made, said):
        assert [(await said.ping()).sequence for _ in range(UNANSWERED)] == [0, 1]
        await passes()
        made.begin()
        assert [(await said.ping()).sequence for _ in range(UNANSWERED)] == [0, 1]
        await passes()
        assert said.empty
