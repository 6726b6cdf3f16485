from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bunraku.ingest.places import Places
from bunraku.ingest.results import Refused
from tests.servers import clip


def done(places: Places) -> dict[tuple[str, ...], int]:
    return {labels: sum(times.counts) for labels, times in places.times().items()}


async def test_who_waits_and_who_works_is_known() -> None:
    places = Places(1)
    async with places:
        waiting = [asyncio.create_task(places.acquire()) for _ in range(3)]
        await asyncio.sleep(0)
        assert (places.waiting, places.locked()) == (3, True)
        waiting[2].cancel()
        await asyncio.wait(waiting[2:])
        assert places.waiting == 2
    await waiting[0]
    assert places.waiting == 1
    places.release()
    await waiting[1]
    assert places.waiting == places.at_work == 0


async def test_a_job_counts_by_how_it_ended(tmp_path: Path) -> None:
    places, source = Places(2), tmp_path / "source"
    source.write_bytes(clip(0.5))
    seen = []
    await places.run("make", ("m1", source), 60, lambda _: seen.append(places.at_work))
    assert set(seen) == {1}
    assert isinstance(await places.run("make", ("m1", tmp_path / "missing"), 60), Refused)
    assert done(places) == {("make", "made"): 1, ("make", "refused"): 1}
    source.write_bytes(clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(places.run("make", ("m1", source), 60, lambda _: encoding.set()))
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert done(places)["make", "broken off"] == 1
    assert places.at_work == 0
    assert all(times.total > 0 for times in places.times().values())
