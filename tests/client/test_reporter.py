from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from bunraku.client import reporter
from bunraku.client.reporter import INITIAL_PINGS, MAX_UNANSWERED_PINGS, ViewerReporter
from bunraku.wire.messages import Ping, Report, unpack

REPORT = Report(3_000_000, 400)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reporter, "INITIAL_PING_INTERVAL_S", 0.0)
    monkeypatch.setattr(reporter, "PING_INTERVAL_S", 0.0)


class MessageRecorder:
    """Messages in the order of their sending."""

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
async def running_reporter() -> AsyncIterator[tuple[ViewerReporter, MessageRecorder]]:
    said, now = MessageRecorder(), iter(range(1_000_000))
    made = ViewerReporter(said.send, lambda: next(now), lambda: REPORT)
    made.restart()
    task = asyncio.create_task(made.run())
    try:
        yield made, said
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def run_event_loop() -> None:
    """Run enough iterations of the event loop for every message that is not withheld to be sent."""
    for _ in range(50):
        await asyncio.sleep(0)


async def test_it_asks_and_after_the_first_few_tells_too_how_it_fares() -> None:
    async with running_reporter() as (made, said):
        for sequence in range(INITIAL_PINGS):
            assert await said.next() == Ping(sequence, sequence)
            made.on_pong(sequence)
        assert await said.next() == Ping(INITIAL_PINGS, INITIAL_PINGS)
        assert await said.next() == REPORT


async def test_while_what_it_asked_is_not_answered_it_says_no_more() -> None:
    async with running_reporter() as (made, said):
        assert [(await said.ping()).sequence for _ in range(MAX_UNANSWERED_PINGS)] == [0, 1]
        await run_event_loop()
        assert said.empty
        made.on_pong(0)
        assert (await said.ping()).sequence == 2
        await run_event_loop()
        assert said.empty
        # an answer says that those before it have nothing to wait for either
        made.on_pong(2)
        assert [(await said.ping()).sequence for _ in range(MAX_UNANSWERED_PINGS)] == [3, 4]


async def test_over_a_new_line_it_asks_anew_and_what_the_old_one_owes_is_forgotten() -> None:
    async with running_reporter() as (made, said):
        assert [(await said.ping()).sequence for _ in range(MAX_UNANSWERED_PINGS)] == [0, 1]
        await run_event_loop()
        made.restart()
        assert [(await said.ping()).sequence for _ in range(MAX_UNANSWERED_PINGS)] == [0, 1]
        await run_event_loop()
        assert said.empty
