from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bunraku.ingest.result import JobRejection
from bunraku.ingest.worker_slots import WorkerSlots
from tests.servers import make_bvh_clip


def outcome_counts(places: WorkerSlots) -> dict[tuple[str, ...], int]:
    return {labels: sum(times.counts) for labels, times in places.durations().items()}


async def test_who_waits_and_who_works_is_known() -> None:
    places = WorkerSlots(1)
    async with places:
        waiting = [asyncio.create_task(places.acquire()) for _ in range(3)]
        await asyncio.sleep(0)
        assert (places.waiting_jobs, places.locked()) == (3, True)
        waiting[2].cancel()
        await asyncio.wait(waiting[2:])
        assert places.waiting_jobs == 2
    await waiting[0]
    assert places.waiting_jobs == 1
    places.release()
    await waiting[1]
    assert places.waiting_jobs == places.running_jobs == 0


async def test_a_job_counts_by_how_it_ended(tmp_path: Path) -> None:
    places, source = WorkerSlots(2), tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.5))
    seen = []
    await places.run_job("make", ("m1", source), 60, lambda _: seen.append(places.running_jobs))
    assert set(seen) == {1}
    assert isinstance(await places.run_job("make", ("m1", tmp_path / "missing"), 60), JobRejection)
    assert outcome_counts(places) == {("make", "made"): 1, ("make", "refused"): 1}
    source.write_bytes(make_bvh_clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(places.run_job("make", ("m1", source), 60, lambda _: encoding.set()))
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert outcome_counts(places)["make", "broken off"] == 1
    assert places.running_jobs == 0
    assert all(times.total_s > 0 for times in places.durations().values())
