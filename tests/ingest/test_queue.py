from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from bunraku.backing import request_id
from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.catalogue import Job
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.backing.tables import JOBS
from bunraku.ingest import queue
from bunraku.ingest.queue import Queue


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[Backing]:
    async with open_backing(Settings(data=tmp_path / "data")) as opened:
        yield opened


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(queue, "LOOK", 0.02)
    monkeypatch.setattr(queue, "HELD", 400_000)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "sent"
    path.write_bytes(b"what was sent")
    return path


class Replica:
    """One replica's queue, which notes what it makes."""

    def __init__(self, backing: Backing, error: Exception | None = None) -> None:
        self.queue = Queue(backing, asyncio.Semaphore(2))
        self.made: list[tuple[dict[str, Any], bytes]] = []
        self.requests: list[str] = []
        self.once = asyncio.Event()
        self._error = error
        self.queue.kinds["motion"] = self._make
        self._running = asyncio.create_task(self.queue.run())

    async def _make(self, details: dict[str, Any], path: Path) -> None:
        self.made.append((details, await asyncio.to_thread(path.read_bytes)))
        self.requests.append(request_id.current())
        self.once.set()
        if self._error is not None:
            raise self._error

    async def end(self) -> None:
        self._running.cancel()
        await asyncio.wait((self._running,))


async def jobs(backing: Backing) -> int:
    """How many there are, held or not."""
    async with (await backing.catalogue.open())._engine.connect() as connection:
        return int((await connection.execute(select(func.count()).select_from(JOBS))).scalar_one())


async def until(there: int, backing: Backing) -> None:
    """Wait until so many jobs are there."""
    async with asyncio.timeout(20):
        while await jobs(backing) != there:  # noqa: ASYNC110
            await asyncio.sleep(0.02)


async def nothing_left(backing: Backing) -> bool:
    """Whether no job is there, and no file."""
    return await jobs(backing) == 0 and await backing.library.get_source("j1") is None


async def settled(backing: Backing) -> None:
    await until(0, backing)
    async with asyncio.timeout(20):
        while not await nothing_left(backing):  # noqa: ASYNC110
            await asyncio.sleep(0.02)


DETAILS = {"kind": "motion", "filename": "a.bvh"}


async def test_what_comes_to_its_end_leaves_nothing(backing: Backing, source: Path) -> None:
    here = Replica(backing)
    async with here.queue.noted("j1", DETAILS, source):
        assert await backing.library.get_source("j1") == b"what was sent"
    assert await nothing_left(backing)
    with pytest.raises(ProblemError):
        async with here.queue.noted("j1", DETAILS, source):
            raise ProblemError(422, "No dance", "nobody moves")
    assert await nothing_left(backing)
    assert here.made == []
    await here.end()


async def test_what_is_at_work_is_left_alone_however_long_it_takes(backing: Backing, source: Path) -> None:
    here, other = Replica(backing), Replica(backing)
    async with here.queue.noted("j1", DETAILS, source):
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.5):
                await other.once.wait()
    await other.end()
    await here.end()


@pytest.mark.parametrize("in_order", [False, True])
async def test_what_a_replica_leaves_is_made_by_another(backing: Backing, source: Path, in_order: bool) -> None:
    gone = Replica(backing)

    async def forever() -> None:
        with request_id.at_work("sending-01"):
            async with gone.queue.noted("j1", DETAILS, source):
                await asyncio.Event().wait()

    working = asyncio.create_task(forever())
    await until(1, backing)
    await gone.end()
    working.cancel()
    await asyncio.wait((working,))
    if in_order:
        await gone.queue.close()
    other = Replica(backing)
    async with asyncio.timeout(20):
        await other.once.wait()
    await settled(backing)
    assert other.made == [({**DETAILS, "request_id": "sending-01"}, b"what was sent")]
    # in the name of the request that sent it, though that was another process's
    assert other.requests == ["sending-01"]
    assert (gone.queue.resumed, other.queue.resumed) == (0, 1)
    await other.end()


@pytest.mark.parametrize(
    ("error", "times"),
    [(ProblemError(422, "No dance", "nobody moves"), 1), (ProblemError(507, "No room left", "none"), queue.TRIES)],
    ids=["nothing_in_it", "no_room"],
)
async def test_what_fails_for_the_moment_is_tried_again_until_it_is_given_up_and_the_rest_is_not(
    backing: Backing, error: ProblemError, times: int
) -> None:
    await backing.library.put_source("j1", b"what was sent")
    await backing.catalogue.add_job(Job("j1", 1, DETAILS), "gone", 0)
    here = Replica(backing, error)
    await settled(backing)
    assert len(here.made) == times
    await here.end()


async def test_a_job_of_a_kind_that_nobody_knows_is_given_up(backing: Backing) -> None:
    await backing.catalogue.add_job(Job("j1", 1, {"kind": "opera"}), "gone", 0)
    here = Replica(backing)
    await settled(backing)
    assert here.made == []
    await here.end()
