from __future__ import annotations

import asyncio
from itertools import count
from pathlib import Path

import pytest

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobRejection
from bunraku.ingest.worker_slots import WorkerSlots
from tests.servers import make_bvh_clip


def outcome_counts(slots: WorkerSlots) -> dict[tuple[str, ...], int]:
    return {labels: sum(times.counts) for labels, times in slots.durations().items()}


async def test_waiting_jobs_are_counted() -> None:
    slots = WorkerSlots(1)
    async with slots:
        waiting = [asyncio.create_task(slots.acquire()) for _ in range(3)]
        await asyncio.sleep(0)
        assert (slots.waiting_jobs, slots.locked()) == (3, True)
        waiting[2].cancel()
        await asyncio.wait(waiting[2:])
        assert slots.waiting_jobs == 2
    await waiting[0]
    assert slots.waiting_jobs == 1
    slots.release()
    await waiting[1]
    assert slots.waiting_jobs == slots.running_jobs == 0


async def test_jobs_are_counted_by_outcome(tmp_path: Path) -> None:
    slots, source = WorkerSlots(2, count().__next__), tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.5))
    seen = []
    await slots.run_job(JobKind.MOTION, ("m1", source), 60, lambda _: seen.append(slots.running_jobs))
    assert set(seen) == {1}
    assert isinstance(await slots.run_job(JobKind.MOTION, ("m1", tmp_path / "missing"), 60), JobRejection)
    assert outcome_counts(slots) == {("make", "made"): 1, ("make", "refused"): 1}
    source.write_bytes(make_bvh_clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(slots.run_job(JobKind.MOTION, ("m1", source), 60, lambda _: encoding.set()))
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert outcome_counts(slots)["make", "broken off"] == 1
    assert slots.running_jobs == 0
    # the clock advances by one between the start and the end of each job
    assert all(times.total_s == sum(times.counts) for times in slots.durations().values())
