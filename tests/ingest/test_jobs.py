from __future__ import annotations

import asyncio
import multiprocessing
from pathlib import Path

import pytest

from bunraku.ingest import jobs
from bunraku.ingest.results import Made, Refused
from tests.servers import clip


async def test_a_job_makes_a_motion_in_another_process(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(clip(0.5))
    shares: list[float] = []
    made = await jobs.run("make", ("m1", source), 60, shares.append)
    assert isinstance(made, Made)
    assert made.described["frames"] == 15
    assert shares == sorted(set(shares))
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert 5 < len(shares) <= jobs.SHARES + 1


async def test_a_reader_that_breaks_off_is_a_refusal(tmp_path: Path) -> None:
    made = await jobs.run("make", ("m1", tmp_path / "missing"), 60)
    assert isinstance(made, Refused)
    assert made.hint


async def test_a_job_that_nobody_waits_for_is_ended(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(jobs.run("make", ("m1", source), 60, lambda _: encoding.set()))
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert not multiprocessing.active_children()


async def test_a_job_is_ended_in_time(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(clip(20.0))
    refused = await jobs.run("make", ("m1", source), 0.001)
    assert isinstance(refused, Refused)
    assert "long" in refused.title
