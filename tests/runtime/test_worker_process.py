from __future__ import annotations

import asyncio
import multiprocessing
import os
import time
from collections.abc import Callable

import pytest

from bunraku.runtime import worker_process
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.worker_process import WorkerCrashed, WorkerOutOfMemory, WorkerTimedOut, run_in_worker
from tests.time_limit import HANG_TIMEOUT_S


def describe_process(parent: int) -> tuple[bool, int]:
    return os.getpid() == parent, os.nice(0)


def count_to(limit: int, report_progress: Callable[[float], None]) -> int:
    for number in range(limit + 1):
        report_progress(number / limit)
    return limit


def reject(field: str) -> None:
    raise ProblemError(422, "Invalid request", "no such field", field=field)


def fill_memory() -> bytes:
    return bytes(worker_process.MAX_MEMORY_BYTES)


def crash() -> None:
    os.abort()


def raise_error() -> None:
    raise LookupError("unexpected")


async def test_function_runs_in_another_process_with_lower_priority() -> None:
    is_same_process, niceness = await run_in_worker(describe_process, (os.getpid(),), HANG_TIMEOUT_S)
    assert not is_same_process
    assert niceness == os.nice(0) + worker_process.WORKER_NICENESS


async def test_progress_is_reported_in_bounded_steps() -> None:
    shares: list[float] = []
    assert await run_in_worker(count_to, (10_000,), HANG_TIMEOUT_S, shares.append) == 10_000
    assert shares == sorted(set(shares))
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert len(shares) == worker_process.MAX_PROGRESS_REPORTS + 1


async def test_problem_keeps_its_members() -> None:
    with pytest.raises(ProblemError) as raised:
        await run_in_worker(reject, ("camera",), HANG_TIMEOUT_S)
    assert raised.value.to_dict() == {
        "status": 422,
        "title": "Invalid request",
        "detail": "no such field",
        "field": "camera",
    }


async def test_memory_beyond_the_limit_is_reported() -> None:
    with pytest.raises(WorkerOutOfMemory, match="GiB"):
        await run_in_worker(fill_memory, (), HANG_TIMEOUT_S)


@pytest.mark.parametrize("function", [crash, raise_error])
async def test_crash_is_reported(function: Callable[[], None]) -> None:
    with pytest.raises(WorkerCrashed):
        await run_in_worker(function, (), HANG_TIMEOUT_S)
    assert not multiprocessing.active_children()


async def test_process_is_killed_at_its_time_limit() -> None:
    with pytest.raises(WorkerTimedOut):
        await run_in_worker(time.sleep, (HANG_TIMEOUT_S,), 0.01)
    assert not multiprocessing.active_children()


async def test_cancellation_kills_the_process() -> None:
    running = asyncio.create_task(run_in_worker(time.sleep, (HANG_TIMEOUT_S,), HANG_TIMEOUT_S))
    while not multiprocessing.active_children():  # noqa: ASYNC110
        await asyncio.sleep(0.01)
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    assert not multiprocessing.active_children()
