from __future__ import annotations

import asyncio
import socket
import time

import pytest

from bunraku.runtime.availability import BackendTimeout, BackendUnavailable


async def test_answers_and_errors_come_as_they_are() -> None:
    async def answer() -> int:
        return 7

    async def refuse() -> int:
        raise KeyError("no")

    patience = BackendTimeout("the test")
    assert await patience.wait(answer()) == 7
    assert await patience.wait(answer(), None) == 7
    with pytest.raises(KeyError):
        await patience.wait(refuse())


async def test_who_waits_in_vain_is_let_go_before_what_they_waited_for_has_ended() -> None:
    ended = asyncio.Event()
    go = asyncio.Event()

    async def stubborn() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            await go.wait()
            ended.set()

    patience = BackendTimeout("the test")
    with pytest.raises(BackendUnavailable, match="the test"):
        await patience.wait(stubborn(), 0.31)
    assert not ended.is_set()
    go.set()
    await patience.drain_abandoned()
    assert ended.is_set()


async def test_who_goes_away_takes_the_question_along() -> None:
    cancelled = asyncio.Event()

    async def never() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()

    waiting = asyncio.create_task(BackendTimeout("the test").wait(never(), None))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    async with asyncio.timeout(20):
        await cancelled.wait()


async def test_a_loop_that_stood_still_hears_what_came_meanwhile() -> None:
    loop = asyncio.get_running_loop()
    here, there = socket.socketpair()
    here.setblocking(False)

    async def through(tasks: int) -> bytes:
        # as a driver has it: several wait for each other
        return await (asyncio.create_task(through(tasks - 1)) if tasks else loop.sock_recv(here, 1))

    with here, there:
        waiting = asyncio.create_task(BackendTimeout("the test").wait(through(4), 0.35))
        for _ in range(8):
            await asyncio.sleep(0)

        def stand_still() -> None:
            there.send(b"x")
            time.sleep(0.2)

        loop.call_soon(stand_still)
        assert await waiting == b"x"
