from __future__ import annotations

import asyncio
from itertools import count
from pathlib import Path

import pytest

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobRejection
from bunraku.ingest.worker_slots import WorkerSlots
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


def outcome_counts(slots: WorkerSlots) -> dict[tuple[str, ...], int]:
    return {labels: sum(times.counts) for labels, times in slots.durations().items()}


async def hold_briefly(slots: WorkerSlots, subject: str, order: list[str] | None = None) -> None:
    async with slots.hold(subject):
        if order is not None:
            order.append(subject)


async def test_waiting_jobs_are_counted() -> None:
    slots = WorkerSlots(1)
    async with slots.hold("aiko"):
        waiting = [asyncio.create_task(hold_briefly(slots, "ben")) for _ in range(3)]
        await asyncio.sleep(0)
        assert (slots.waiting_jobs, slots.locked()) == (3, True)
        waiting[2].cancel()
        await asyncio.wait(waiting[2:])
        assert slots.waiting_jobs == 2
    await asyncio.gather(*waiting[:2])
    assert slots.waiting_jobs == slots.running_jobs == 0
    assert not slots.locked()


async def test_jobs_wait_until_the_machine_is_prepared() -> None:
    prepared = asyncio.Event()
    slots = WorkerSlots(2, prepared=prepared)
    order = list[str]()
    waiting = [asyncio.create_task(hold_briefly(slots, name, order)) for name in ("aiko", "ben")]
    for _ in range(3):
        await asyncio.sleep(0)
    waiting[1].cancel()
    assert (order, slots.is_preparing) == ([], True)
    prepared.set()
    assert (order, slots.is_preparing) == ([], False)
    await asyncio.wait(waiting)
    assert order == ["aiko"]
    assert not slots.locked()


async def test_one_subject_leaves_a_slot_to_others() -> None:
    slots, order = WorkerSlots(2), list[str]()
    async with slots.hold("aiko"):
        waiting = [asyncio.create_task(hold_briefly(slots, "aiko", order)) for _ in range(3)]
        await asyncio.sleep(0)
        assert slots.waiting_jobs == 3
        # a later subject gets the free slot at once
        async with slots.hold("ben"):
            assert slots.locked()
        assert order == []
    await asyncio.gather(*waiting)
    assert order == ["aiko"] * 3
    assert not slots.locked()


async def test_free_slot_goes_to_the_subject_with_the_fewest() -> None:
    slots, order = WorkerSlots(3), list[str]()
    async with slots.hold("aiko"), slots.hold("ben"):
        async with slots.hold("carol"):
            names = ["aiko", "ben", "dai", "carol"]
            waiting = [asyncio.create_task(hold_briefly(slots, name, order)) for name in names]
            await asyncio.sleep(0)
        # with carol's slot free, dai and carol hold none
        while len(order) < 2:  # noqa: ASYNC110
            await asyncio.sleep(0)
        assert order == ["dai", "carol"]
    await asyncio.gather(*waiting)
    assert sorted(order) == sorted(names)


async def test_jobs_of_nobody_in_particular_use_all_slots() -> None:
    slots = WorkerSlots(2)
    async with slots.hold(""), slots.hold(""):
        assert slots.locked()


async def test_slot_of_a_job_cancelled_while_it_is_granted_is_free_again() -> None:
    slots = WorkerSlots(1)
    async with slots.hold("aiko"):
        waiting = asyncio.create_task(hold_briefly(slots, "ben"))
        await asyncio.sleep(0)
    # the slot is granted, but the task has not continued yet
    assert slots.locked()
    waiting.cancel()
    await asyncio.wait((waiting,))
    assert not slots.locked()
    async with slots.hold("carol"):
        assert slots.locked()


async def test_jobs_are_counted_by_outcome(tmp_path: Path) -> None:
    slots, source = WorkerSlots(2, count().__next__), tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.5))
    seen = []
    await slots.run_job(
        JobKind.MOTION, ("m1", source, None, False), HANG_TIMEOUT_S, lambda _: seen.append(slots.running_jobs)
    )
    assert set(seen) == {1}
    assert isinstance(
        await slots.run_job(JobKind.MOTION, ("m1", tmp_path / "missing", None, False), HANG_TIMEOUT_S), JobRejection
    )
    assert outcome_counts(slots) == {("make", "made"): 1, ("make", "refused"): 1}
    source.write_bytes(make_bvh_clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(
        slots.run_job(JobKind.MOTION, ("m1", source, None, False), HANG_TIMEOUT_S, lambda _: encoding.set())
    )
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert outcome_counts(slots)["make", "broken off"] == 1
    assert slots.running_jobs == 0
    # the clock advances by one between the start and the end of each job
    assert all(times.total_s == sum(times.counts) for times in slots.durations().values())
