from __future__ import annotations

import asyncio
import multiprocessing
from pathlib import Path

import pytest

from bunraku.ingest import worker
from bunraku.ingest.result import JobRejection, JobResult
from tests.servers import make_bvh_clip


async def test_a_job_makes_a_motion_in_another_process(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.5))
    shares: list[float] = []
    made = await worker.run_job("make", ("m1", source), 60, shares.append)
    assert isinstance(made, JobResult)
    assert made.description["frames"] == 15
    assert shares == sorted(set(shares))
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert 5 < len(shares) <= worker.MAX_PROGRESS_REPORTS + 1


async def test_a_reader_that_breaks_off_is_a_refusal(tmp_path: Path) -> None:
    made = await worker.run_job("make", ("m1", tmp_path / "missing"), 60)
    assert isinstance(made, JobRejection)
    assert made.hint


async def test_a_job_that_nobody_waits_for_is_ended(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(worker.run_job("make", ("m1", source), 60, lambda _: encoding.set()))
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert not multiprocessing.active_children()


async def test_a_job_is_ended_in_time(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(20.0))
    refused = await worker.run_job("make", ("m1", source), 0.001)
    assert isinstance(refused, JobRejection)
    assert "long" in refused.title
