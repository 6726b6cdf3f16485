from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from bunraku.ingest import job_queue
from bunraku.ingest.job_queue import JobQueue
from bunraku.runtime import request_id
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.record import Job
from bunraku.storage.table import JOBS


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path / "data")) as opened:
        yield opened


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job_queue, "POLL_INTERVAL_S", 0.02)
    monkeypatch.setattr(job_queue, "JOB_LEASE_US", 400_000)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "sent"
    path.write_bytes(b"what was sent")
    return path


class QueueReplica:
    """One replica's queue, which notes what it makes."""

    def __init__(self, backing: ServiceContext, error: Exception | None = None) -> None:
        self.queue = JobQueue(backing, asyncio.Semaphore(2))
        self.handled_jobs: list[tuple[dict[str, Any], bytes]] = []
        self.requests: list[str] = []
        self.first_job_handled = asyncio.Event()
        self._error = error
        self.queue.handlers["motion"] = self._handle_job
        self._running = asyncio.create_task(self.queue.run())

    async def _handle_job(self, details: dict[str, Any], path: Path) -> None:
        self.handled_jobs.append((details, await asyncio.to_thread(path.read_bytes)))
        self.requests.append(request_id.current())
        self.first_job_handled.set()
        if self._error is not None:
            raise self._error

    async def stop(self) -> None:
        self._running.cancel()
        await asyncio.wait((self._running,))


async def count_jobs(backing: ServiceContext) -> int:
    """How many there are, held or not."""
    async with (await backing.catalogue.open())._engine.connect() as connection:
        return int((await connection.execute(select(func.count()).select_from(JOBS))).scalar_one())


async def wait_for_job_count(expected: int, backing: ServiceContext) -> None:
    """Wait until so many jobs are there."""
    async with asyncio.timeout(20):
        while await count_jobs(backing) != expected:  # noqa: ASYNC110
            await asyncio.sleep(0.02)


async def is_empty(backing: ServiceContext) -> bool:
    """Whether no job is there, and no file."""
    return await count_jobs(backing) == 0 and await backing.motion_store.get_source("j1") is None


async def wait_until_empty(backing: ServiceContext) -> None:
    await wait_for_job_count(0, backing)
    async with asyncio.timeout(20):
        while not await is_empty(backing):  # noqa: ASYNC110
            await asyncio.sleep(0.02)


DETAILS = {"kind": "motion", "filename": "a.bvh"}


async def test_what_comes_to_its_end_leaves_nothing(backing: ServiceContext, source: Path) -> None:
    here = QueueReplica(backing)
    async with here.queue.persist_job("j1", DETAILS, source):
        assert await backing.motion_store.get_source("j1") == b"what was sent"
    assert await is_empty(backing)
    with pytest.raises(ProblemError):
        async with here.queue.persist_job("j1", DETAILS, source):
            raise ProblemError(422, "No dance", "nobody moves")
    assert await is_empty(backing)
    assert here.handled_jobs == []
    await here.stop()


async def test_what_is_at_work_is_left_alone_however_long_it_takes(backing: ServiceContext, source: Path) -> None:
    here, other = QueueReplica(backing), QueueReplica(backing)
    async with here.queue.persist_job("j1", DETAILS, source):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5):
                await other.first_job_handled.wait()
    await other.stop()
    await here.stop()


@pytest.mark.parametrize("in_order", [False, True])
async def test_what_a_replica_leaves_is_made_by_another(backing: ServiceContext, source: Path, in_order: bool) -> None:
    gone = QueueReplica(backing)

    async def forever() -> None:
        with request_id.bind("sending-01"):
            async with gone.queue.persist_job("j1", DETAILS, source):
                await asyncio.Event().wait()

    working = asyncio.create_task(forever())
    await wait_for_job_count(1, backing)
    await gone.stop()
    working.cancel()
    await asyncio.wait((working,))
    if in_order:
        await gone.queue.release_jobs()
    other = QueueReplica(backing)
    async with asyncio.timeout(20):
        await other.first_job_handled.wait()
    await wait_until_empty(backing)
    assert other.handled_jobs == [({**DETAILS, "request_id": "sending-01"}, b"what was sent")]
    # in the name of the request that sent it, though that was another process's
    assert other.requests == ["sending-01"]
    assert (gone.queue.resumed_jobs, other.queue.resumed_jobs) == (0, 1)
    await other.stop()


@pytest.mark.parametrize(
    ("error", "times"),
    [
        (ProblemError(422, "No dance", "nobody moves"), 1),
        (ProblemError(507, "No room left", "none"), job_queue.MAX_ATTEMPTS),
    ],
    ids=["nothing_in_it", "no_room"],
)
async def test_what_fails_for_the_moment_is_tried_again_until_it_is_given_up_and_the_rest_is_not(
    backing: ServiceContext, error: ProblemError, times: int
) -> None:
    await backing.motion_store.put_source("j1", b"what was sent")
    await backing.catalogue.add_job(Job("j1", 1, DETAILS), "gone", 0)
    here = QueueReplica(backing, error)
    await wait_until_empty(backing)
    assert len(here.handled_jobs) == times
    await here.stop()


async def test_a_job_of_a_kind_that_nobody_knows_is_given_up(backing: ServiceContext) -> None:
    await backing.catalogue.add_job(Job("j1", 1, {"kind": "opera"}), "gone", 0)
    here = QueueReplica(backing)
    await wait_until_empty(backing)
    assert here.handled_jobs == []
    await here.stop()
