from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from pydantic import SecretStr

from bunraku.ingest.job_queue import JobQueue, JobQueueTiming, UploadJob
from bunraku.ingest.motion import MotionOperation
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.takes import MAX_LATER_JOBS, MAX_TAKES, TakesOperation, TakesOutcome, create_takes_job
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from tests.ingest.test_job_queue import count_jobs, wait_for_job_count
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.readers.sources import write_zip
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

CLIPS = {f"{seed}.bvh": make_bvh_clip(0.4, seed) for seed in range(3)}
POSE = make_bvh_clip(1 / 30)


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path / "data")) as opened:
        yield opened


def write_source(folder: Path, data: bytes) -> tuple[Path, UploadJob]:
    path = folder / "source"
    path.write_bytes(data)
    return path, create_takes_job(hashlib.sha256(data).digest(), "pack.zip", "aiko")


def create_operation(context: ServiceContext, answer_s: float | None = None) -> tuple[TakesOperation, JobQueue]:
    slots = WorkerSlots()
    operation = TakesOperation(context, slots, MotionOperation(context, slots), answer_s)
    return operation, JobQueue(context, slots, {"takes": operation.run_job}, JobQueueTiming(poll_s=0.01))


async def stored_names(context: ServiceContext) -> list[str]:
    entries, _ = await context.catalogue.list_motions(200, None)
    return sorted(entry.description["name"].removeprefix("pack \N{EN DASH} ") for entry in entries)


async def receive(context: ServiceContext, folder: Path, data: bytes) -> TakesOutcome:
    operation, queue = create_operation(context)
    path, job = write_source(folder, data)
    return await operation.receive(queue, job, path, UploadProgress())


async def test_each_take_is_stored_once_and_bad_ones_are_named(context: ServiceContext, tmp_path: Path) -> None:
    data = write_zip({**CLIPS, "bad.bvh": b"HIERARCHY\nROOT hips\n{\n", "pose.bvh": POSE})
    outcome = await receive(context, tmp_path, data)
    assert outcome.status == 201
    assert await stored_names(context) == [*CLIPS]
    assert {entry.subject for entry, _ in outcome.stored} == {"aiko"}
    assert [name for name, _ in outcome.skipped] == ["bad.bvh", "pose.bvh"]
    assert [item["title"] for item in outcome.to_json()["skipped"]] == ["No motion", "Nothing moves"]
    repeated = await receive(context, tmp_path, data)
    assert (repeated.status, repeated.to_json()) == (200, outcome.to_json())
    assert await count_jobs(context) == 0


async def test_progress_counts_takes(context: ServiceContext, tmp_path: Path) -> None:
    operation, queue = create_operation(context)
    path, job = write_source(tmp_path, write_zip(CLIPS))
    progress = UploadProgress()
    await operation.receive(queue, job, path, progress)
    assert (progress.take, progress.takes, progress.stage, progress.share) == (3, 3, "encoding", 1.0)


@pytest.mark.parametrize(
    ("files", "title", "take"),
    [
        ({"a.bvh": POSE, "b.bvh": b"nothing"}, "Not a BVH file", "b.bvh"),
        ({"a.bvh": POSE, "b.bvh": POSE}, "Nothing moves", "a.bvh"),
        ({"readme.txt": b"hello"}, "No motion", None),
    ],
)
async def test_file_without_any_motion_is_a_problem(
    files: dict[str, bytes], title: str, take: str | None, context: ServiceContext, tmp_path: Path
) -> None:
    with pytest.raises(ProblemError) as raised:
        await receive(context, tmp_path, write_zip(files))
    assert (raised.value.status, raised.value.title, raised.value.extra.get("take")) == (422, title, take)
    assert await stored_names(context) == []


async def test_takes_beyond_the_quota_are_skipped(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path / "data", quota_motions=2, secret=SecretStr("s" * 32))) as context:
        outcome = await receive(context, tmp_path, write_zip(CLIPS))
        assert await stored_names(context) == ["0.bvh", "1.bvh"]
        assert [(name, problem.title) for name, problem in outcome.skipped] == [("2.bvh", "Quota used up")]
        with pytest.raises(ProblemError) as raised:
            await receive(context, tmp_path, write_zip({name: data + b"\n" for name, data in CLIPS.items()}))
        assert raised.value.status == 403


async def test_takes_that_would_delay_the_answer_follow(context: ServiceContext, tmp_path: Path) -> None:
    operation, queue = create_operation(context, answer_s=0.0)
    path, job = write_source(tmp_path, write_zip(CLIPS))
    outcome = await operation.receive(queue, job, path, UploadProgress())
    assert (outcome.status, outcome.pending) == (202, [*CLIPS])
    running = asyncio.create_task(queue.run())
    await wait_for_job_count(0, context)
    running.cancel()
    await asyncio.wait((running,))
    assert await stored_names(context) == [*CLIPS]


async def test_few_jobs_of_a_subject_are_finished_later(context: ServiceContext, tmp_path: Path) -> None:
    operation, queue = create_operation(context, answer_s=0.0)
    files = [write_zip({**CLIPS, "note": b"%d" % number}) for number in range(MAX_LATER_JOBS + 1)]

    async def send(number: int) -> TakesOutcome:
        path, job = write_source(tmp_path, files[number])
        return await operation.receive(queue, job, path, UploadProgress())

    for number in range(MAX_LATER_JOBS):
        assert (await send(number)).status == 202
    with pytest.raises(ProblemError) as raised:
        await send(MAX_LATER_JOBS)
    assert (raised.value.status, raised.value.title) == (503, "Out of time")
    assert await count_jobs(context) == MAX_LATER_JOBS
    assert (await send(0)).status == 202


async def test_another_replica_goes_on_after_a_crash(context: ServiceContext, tmp_path: Path) -> None:
    """The first replica stops after its first take, without any sign."""
    operation, queue = create_operation(context)
    path, job = write_source(tmp_path, write_zip(CLIPS))
    second_take = asyncio.Event()

    class WatchedProgress(UploadProgress):
        def begin_take(self, take: int, takes: int) -> None:
            if (take, takes) == (2, 3):
                second_take.set()

    interrupted = asyncio.create_task(operation.receive(queue, job, path, WatchedProgress()))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await second_take.wait()
    interrupted.cancel()
    await asyncio.wait((interrupted,))
    assert await stored_names(context) == ["0.bvh"]
    await queue.release_jobs()
    _, other = create_operation(context)
    running = asyncio.create_task(other.run())
    await wait_for_job_count(0, context)
    running.cancel()
    await asyncio.wait((running,))
    assert await stored_names(context) == [*CLIPS]


async def test_takes_beyond_the_limit_are_said(context: ServiceContext, tmp_path: Path) -> None:
    data = write_zip({f"{number:02}.bvh": b"nothing" for number in range(MAX_TAKES + 6)} | {"00.bvh": CLIPS["0.bvh"]})
    outcome = await receive(context, tmp_path, data)
    assert await stored_names(context) == ["00.bvh"]
    assert len(outcome.skipped) == MAX_TAKES
    assert outcome.to_json()["skipped"][-1]["take"] is None
    assert "70 takes" in outcome.skipped[-1][1].detail


async def test_takes_of_equal_names_are_told_apart(context: ServiceContext, tmp_path: Path) -> None:
    outcome = await receive(context, tmp_path, write_fbx(takes=("walk", "walk")))
    assert [entry.description["name"] for entry, _ in outcome.stored] == [
        "pack \N{EN DASH} walk",
        "pack \N{EN DASH} walk (2)",
    ]
