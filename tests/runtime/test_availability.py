from __future__ import annotations

import asyncio
import socket
import time

import pytest

from bunraku.runtime.availability import BackendTimeout, BackendUnavailable
from tests.time_limit import HANG_TIMEOUT_S


async def test_results_and_errors_are_passed_through() -> None:
    async def succeed() -> int:
        return 7

    async def fail() -> int:
        raise KeyError("no")

    timeout = BackendTimeout("the test")
    assert await timeout.wait(succeed()) == 7
    assert await timeout.wait(succeed(), None) == 7
    with pytest.raises(KeyError):
        await timeout.wait(fail())


async def test_timeout_returns_before_the_call_has_ended() -> None:
    ended = asyncio.Event()
    may_end = asyncio.Event()

    async def stubborn() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            await may_end.wait()
            ended.set()

    timeout = BackendTimeout("the test")
    with pytest.raises(BackendUnavailable, match="the test"):
        await timeout.wait(stubborn(), 0.31)
    assert not ended.is_set()
    may_end.set()
    await timeout.drain_abandoned()
    assert ended.is_set()


async def test_cancelled_wait_cancels_the_call() -> None:
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
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await cancelled.wait()


async def test_blocked_event_loop_reads_answers_that_arrived() -> None:
    loop = asyncio.get_running_loop()
    receiver, sender = socket.socketpair()
    receiver.setblocking(False)

    async def receive(nested_tasks: int) -> bytes:
        # nested tasks, as in a database driver
        return await (asyncio.create_task(receive(nested_tasks - 1)) if nested_tasks else loop.sock_recv(receiver, 1))

    with receiver, sender:
        waiting = asyncio.create_task(BackendTimeout("the test").wait(receive(4), 0.35))
        for _ in range(8):
            await asyncio.sleep(0)

        def block() -> None:
            sender.send(b"x")
            time.sleep(0.2)

        loop.call_soon(block)
        assert await waiting == b"x"
