from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from bunraku.ingest import job_queue
from bunraku.ingest.job_queue import JobQueue, JobQueueTiming, UploadJob
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime import request_id
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.runtime.temporary_folder import temporary_folder
from bunraku.storage.record import CatalogueEntry, Job, JobHold
from bunraku.storage.table import JOBS
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path / "data")) as opened:
        yield opened


TIMING = JobQueueTiming(poll_s=0.02, lease_us=400_000)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "sent"
    path.write_bytes(b"uploaded bytes")
    return path


class QueueReplica:
    """Queue of one replica, with a handler that records its calls."""

    def __init__(self, context: ServiceContext, error: Exception | None = None) -> None:
        self.queue = JobQueue(context, WorkerSlots(), {"motion": self._handle_job}, TIMING)
        self.handled_jobs: list[tuple[dict[str, Any], bytes]] = []
        self.requests: list[str] = []
        self.first_job_handled = asyncio.Event()
        self._error = error
        self._running = asyncio.create_task(self.queue.run())

    async def _handle_job(self, details: dict[str, Any], path: Path, _: UploadProgress) -> StoreOutcome:
        self.handled_jobs.append((details, await asyncio.to_thread(path.read_bytes)))
        self.requests.append(request_id.current())
        self.first_job_handled.set()
        if self._error is not None:
            raise self._error
        return StoreOutcome(CatalogueEntry("m1", 1, {}), True)

    async def stop(self) -> None:
        self._running.cancel()
        await asyncio.wait((self._running,))


async def count_jobs(context: ServiceContext) -> int:
    """Return the number of jobs, held or not."""
    async with (await context.catalogue.open())._engine.connect() as connection:
        return int((await connection.execute(select(func.count()).select_from(JOBS))).scalar_one())


async def wait_for_job_count(expected: int, context: ServiceContext) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while await count_jobs(context) != expected:  # noqa: ASYNC110
            await asyncio.sleep(0.02)


async def read_source(context: ServiceContext) -> bytes | None:
    """Return the stored file of job j1, None if there is none."""
    with temporary_folder("job") as folder:
        is_stored = await context.motion_store.copy_source("j1", folder / "source")
        return (folder / "source").read_bytes() if is_stored else None


async def is_empty(context: ServiceContext) -> bool:
    """Return whether there is neither a job nor its file."""
    return await count_jobs(context) == 0 and await read_source(context) is None


async def wait_until_empty(context: ServiceContext) -> None:
    await wait_for_job_count(0, context)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not await is_empty(context):  # noqa: ASYNC110
            await asyncio.sleep(0.02)


DETAILS = {"kind": "motion", "filename": "a.bvh"}
JOB = UploadJob("j1", DETAILS)


async def test_finished_job_is_removed(context: ServiceContext, source: Path) -> None:
    replica = QueueReplica(context)
    async with replica.queue.persist_job(JOB, source):
        assert await read_source(context) == b"uploaded bytes"
    assert await is_empty(context)
    with pytest.raises(ProblemError):
        async with replica.queue.persist_job(JOB, source):
            raise ProblemError(422, "No motion", "all frames are equal")
    assert await is_empty(context)
    assert replica.handled_jobs == []
    await replica.stop()


async def test_running_job_is_not_resumed(context: ServiceContext, source: Path) -> None:
    replica, other = QueueReplica(context), QueueReplica(context)
    async with replica.queue.persist_job(JOB, source):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5):
                await other.first_job_handled.wait()
    await other.stop()
    await replica.stop()


@pytest.mark.parametrize("graceful", [False, True])
async def test_abandoned_job_is_resumed_by_another_replica(
    context: ServiceContext, source: Path, graceful: bool
) -> None:
    failed = QueueReplica(context)

    async def work_forever() -> None:
        with request_id.bind("upload-01"):
            async with failed.queue.persist_job(JOB, source):
                await asyncio.Event().wait()

    task = asyncio.create_task(work_forever())
    await wait_for_job_count(1, context)
    await failed.stop()
    task.cancel()
    await asyncio.wait((task,))
    if graceful:
        await failed.queue.release_jobs()
    other = QueueReplica(context)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await other.first_job_handled.wait()
    await wait_until_empty(context)
    assert other.handled_jobs == [({**DETAILS, "request_id": "upload-01"}, b"uploaded bytes")]
    # under the id of the request that uploaded it
    assert other.requests == ["upload-01"]
    assert (failed.queue.resumed_jobs, other.queue.resumed_jobs) == (0, 1)
    await other.stop()


async def test_resumed_job_is_not_run_again_while_it_is_discarded(
    context: ServiceContext, source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    catalogue, searches = context.catalogue, 0
    list_job_holds, remove_job = catalogue.list_job_holds, catalogue.remove_job

    async def count_search(limit: int) -> dict[str, JobHold]:
        nonlocal searches
        searches += 1
        return await list_job_holds(limit)

    async def remove_slowly(job_id: str) -> None:
        end = searches + 5
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while searches < end:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        await remove_job(job_id)

    monkeypatch.setattr(catalogue, "list_job_holds", count_search)
    monkeypatch.setattr(catalogue, "remove_job", remove_slowly)
    await context.motion_store.put_source("j1", source)
    await catalogue.add_job(Job("j1", 1, DETAILS), "failed", 0)
    replica = QueueReplica(context)
    await wait_until_empty(context)
    assert len(replica.handled_jobs) == replica.queue.resumed_jobs == 1
    await replica.stop()


@pytest.mark.parametrize(
    ("error", "attempts"),
    [
        (ProblemError(422, "No motion", "all frames are equal"), 1),
        (ProblemError(507, "No room left", "none"), job_queue.MAX_ATTEMPTS),
    ],
    ids=["bad_file", "disk_full"],
)
async def test_only_temporary_failures_are_tried_again(
    context: ServiceContext, source: Path, error: ProblemError, attempts: int
) -> None:
    await context.motion_store.put_source("j1", source)
    await context.catalogue.add_job(Job("j1", 1, DETAILS), "failed", 0)
    replica = QueueReplica(context, error)
    await wait_until_empty(context)
    assert len(replica.handled_jobs) == attempts
    await replica.stop()


async def test_job_of_an_unknown_kind_is_given_up(context: ServiceContext) -> None:
    await context.catalogue.add_job(Job("j1", 1, {"kind": "opera"}), "failed", 0)
    replica = QueueReplica(context)
    await wait_until_empty(context)
    assert replica.handled_jobs == []
    await replica.stop()


async def test_job_is_judged_by_the_observers_clock_alone(context: ServiceContext, source: Path) -> None:
    """A holder whose clock is an hour behind keeps its job; one whose clock is an hour ahead loses it when it fails."""
    behind = dataclasses.replace(context, clock=lambda: context.clock() - 3_600_000_000)
    ahead = dataclasses.replace(context, clock=lambda: context.clock() + 3_600_000_000)
    holder, other = QueueReplica(behind), QueueReplica(context)
    async with holder.queue.persist_job(JOB, source):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5):
                await other.first_job_handled.wait()
    await holder.stop()
    await context.motion_store.put_source("j1", source)
    await context.catalogue.add_job(Job("j1", 1, DETAILS), "failed", ahead.clock() + TIMING.lease_us)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await other.first_job_handled.wait()
    await wait_until_empty(context)
    await other.stop()
