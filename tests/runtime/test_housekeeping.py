from __future__ import annotations

import asyncio
from contextlib import AbstractAsyncContextManager
from pathlib import Path

import httpx2
import pytest

from bunraku.runtime import housekeeping
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.housekeeping import Housekeeping
from bunraku.runtime.settings import Settings
from bunraku.storage.motion_store import MotionStore
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


async def wait_until_gone(*paths: Path) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while any(path.exists() for path in paths):  # noqa: ASYNC110
            await asyncio.sleep(0.02)


async def test_objects_of_an_ended_process_are_removed_at_the_start(tmp_path: Path) -> None:
    ended = MotionStore.open(f"file://{tmp_path}/library")
    await ended.put_log("log", b"log")
    (tmp_path / "source").write_bytes(b"source")
    await ended.put_source("source", tmp_path / "source")
    async with open_context(Settings(data=tmp_path)) as context:
        running = asyncio.create_task(Housekeeping(context, has_library=True).run(0.0))
        await wait_until_gone(tmp_path / "library/logs/log", tmp_path / "library/sources/source")
        # a second server with the same folder leaves the files of the first
        await context.motion_store.put_log("log", b"log")
        second = Housekeeping(context, has_library=True)
        async with second._own_library():
            await second.check_library()
        assert await context.motion_store.get_log("log") == b"log"
        running.cancel()
        await asyncio.wait((running,))
        third = Housekeeping(context, has_library=True)
        async with third._own_library():
            await third.check_library()
        assert await context.motion_store.get_log("log") is None


async def test_objects_that_other_processes_may_use_are_removed_after_a_day(tmp_path: Path) -> None:
    library = f"file://{tmp_path}/shared"
    async with open_context(Settings(data=tmp_path / "first", library=library)) as first, first_owns(first):
        await check_objects_of_others(Settings(data=tmp_path / "second", library=library), tmp_path / "shared")


def first_owns(context: ServiceContext) -> AbstractAsyncContextManager[None]:
    return Housekeeping(context, has_library=True)._own_library()


async def check_objects_of_others(settings: Settings, library: Path) -> None:
    async with open_context(settings) as context:
        await context.motion_store.put_log("log", b"log")
        now = (library / "logs/log").stat().st_mtime
        for age_s, is_kept in ((housekeeping.ORPHAN_LIFETIME_S - 1, True), (housekeeping.ORPHAN_LIFETIME_S + 1, False)):
            keeper = Housekeeping(context, has_library=True, clock=lambda: now + age_s)  # noqa: B023
            async with keeper._own_library():
                await keeper.check_library()
            assert (await context.motion_store.get_log("log") is not None) == is_kept


async def test_sweep_is_repeated_daily_and_after_failures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(housekeeping, "MAINTENANCE_INTERVAL_S", 0.001)
    now = 0.0
    checks: list[float] = []
    async with open_context(Settings(data=tmp_path)) as context:

        class Failing(Housekeeping):
            async def check_library(self) -> None:
                checks.append(now)
                if len(checks) < 3:
                    raise RuntimeError("a fault")
                await super().check_library()

        running = asyncio.create_task(Failing(context, has_library=True, clock=lambda: now).run(0.0))
        async with asyncio.timeout(HANG_TIMEOUT_S):
            for expected in (3, 4, 5):
                while len(checks) < expected:  # noqa: ASYNC110
                    await asyncio.sleep(0.001)
                now += housekeeping.SWEEP_INTERVAL_S
        running.cancel()
        await asyncio.wait((running,))
    day = housekeeping.SWEEP_INTERVAL_S
    assert checks == [0.0, 0.0, 0.0, day, 2 * day]


def test_server_hides_a_motion_whose_object_was_lost(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        stored = httpx2.post(
            f"{url}/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5), timeout=HANG_TIMEOUT_S
        ).json()
    (tmp_path / f"library/motions/{stored['id']}.bunraku").unlink()
    with run_server(tmp_path) as url, httpx2.Client(base_url=url, timeout=HANG_TIMEOUT_S) as http:
        while http.get("/v1/motions").json()["items"]:
            pass
        assert http.get(f"/v1/motions/{stored['id']}").status_code == 404
        assert http.delete(f"/v1/motions/{stored['id']}").status_code == 404
        again = http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5))
        assert again.status_code == 201
        assert [item["id"] for item in http.get("/v1/motions").json()["items"]] == [stored["id"]]
