from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import SecretStr

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.performance import ABANDONED_AFTER_S, LIFETIME_S, PerformanceOperation
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.performance_request import PERFORMANCE_SUBJECT, create_performer_id, performed_subject
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from bunraku.playout.performance import pack_sample
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.settings import Settings
from bunraku.storage.performance_store import PerformanceHeader
from tests.time_limit import HANG_TIMEOUT_S

HEADER = PerformanceHeader(create_performer_id("session"), "Aiko", 30.0, standard_figure(), 10**15, "aiko")
REST = np.array([0.0, 0.9, 0.0]), np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


class WallClock:
    """Time of the object store, which a test moves forward."""

    def __init__(self) -> None:
        self.ahead_s = 0.0

    def __call__(self) -> float:
        import time

        return time.time() + self.ahead_s


class SlowSlots(WorkerSlots):
    """Worker slots in which the job of one performance never ends."""

    def __init__(self, slow: str) -> None:
        super().__init__()
        self.slow = slow
        self.is_encoding = asyncio.Event()

    async def run_job(self, kind: JobKind, arguments: tuple[Any, ...], *rest: Any) -> JobResult | JobRejection:
        if arguments[1].id == self.slow:
            self.is_encoding.set()
            await asyncio.Event().wait()
        return await super().run_job(kind, arguments, *rest)


class FailingSlots(WorkerSlots):
    """Worker slots whose jobs crash."""

    def __init__(self) -> None:
        super().__init__()
        self.jobs = 0

    async def run_job(self, *_: Any) -> JobResult | JobRejection:
        self.jobs += 1
        return JobRejection("Unreadable motion", "encoding this performance crashed")


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path / "data")) as opened:
        yield opened


@pytest.fixture
def wall_clock() -> WallClock:
    return WallClock()


@pytest.fixture
def operation(context: ServiceContext, wall_clock: WallClock) -> PerformanceOperation:
    return PerformanceOperation(context, WorkerSlots(), wall_clock)


async def perform(context: ServiceContext, *, frames: int = 20) -> None:
    """Store a header, and samples in two parts if there are any."""
    store = context.motion_store.performances
    await store.put_header(HEADER)
    samples = [pack_sample(10**15 + round(k * 1e6 / 30), REST).pack() for k in range(frames)]
    for number, part in enumerate((samples[::2], samples[1::2])):
        if part:
            await store.put_part(HEADER.id, f"connection-{number}", b"".join(part))


async def test_performance_that_goes_on_is_left_and_an_abandoned_one_becomes_a_motion(
    context: ServiceContext, operation: PerformanceOperation, wall_clock: WallClock
) -> None:
    await perform(context)
    await operation.make_motions()
    assert await context.catalogue.get_motion(HEADER.motion) is None
    shown: list[bytes] = []
    context.bus.subscribe(performed_subject(HEADER.id), shown.append)
    wall_clock.ahead_s = ABANDONED_AFTER_S + 10
    await operation.make_motions()
    entry = await context.catalogue.get_motion(HEADER.motion)
    assert entry is not None
    assert (entry.description["name"], entry.description["frames"], entry.subject) == ("Aiko", 20, "aiko")
    assert await context.motion_store.get(HEADER.motion) is not None
    assert await context.motion_store.performances.list_performances() == {}
    assert shown == [HEADER.motion.encode()]


async def test_announced_end_is_handled_at_once_by_one_of_two_replicas(context: ServiceContext) -> None:
    await perform(context)
    operations = [PerformanceOperation(context, WorkerSlots()) for _ in range(2)]
    tasks = [asyncio.create_task(operation.run()) for operation in operations]
    shown: list[bytes] = []
    context.bus.subscribe(performed_subject(HEADER.id), shown.append)
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not shown:
                context.bus.publish(PERFORMANCE_SUBJECT, HEADER.id.encode())
                await asyncio.sleep(0.05)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    assert shown == [HEADER.motion.encode()]


async def test_performance_without_samples_or_header_leaves_nothing(
    context: ServiceContext, operation: PerformanceOperation, wall_clock: WallClock
) -> None:
    await perform(context, frames=0)
    await context.motion_store.performances.put_part("session-unknown", "connection-0", b"x")
    wall_clock.ahead_s = ABANDONED_AFTER_S + 10
    await operation.make_motions()
    assert await context.motion_store.performances.list_performances() == {}
    assert await context.catalogue.get_motion(HEADER.motion) is None


async def test_used_up_quota_keeps_the_samples_for_a_week(
    tmp_path: Path, wall_clock: WallClock, caplog: pytest.LogCaptureFixture
) -> None:
    settings = Settings(data=tmp_path / "data", secret=SecretStr("x" * 64), quota_motions=1)
    async with open_context(settings) as context:
        operation = PerformanceOperation(context, WorkerSlots(), wall_clock)
        await perform(context)
        wall_clock.ahead_s = ABANDONED_AFTER_S + 10
        await operation.make_motions()
        assert await context.catalogue.get_motion(HEADER.motion) is not None
        other = PerformanceHeader("session-2", "Yuki", 30.0, standard_figure(), 10**15, "aiko")
        await context.motion_store.performances.put_header(other)
        await context.motion_store.performances.put_part("session-2", "c-0", pack_sample(10**15, REST).pack())
        await operation.make_motions()
        assert "is not a motion yet" in caplog.text
        assert set(await context.motion_store.performances.list_performances()) == {"session-2"}
        wall_clock.ahead_s = LIFETIME_S + 10
        await operation.make_motions()
        assert await context.motion_store.performances.list_performances() == {}


async def test_performance_that_is_encoded_for_long_keeps_no_other_waiting(context: ServiceContext) -> None:
    slots = SlowSlots(HEADER.id)
    operation = PerformanceOperation(context, slots)
    await perform(context)
    other = PerformanceHeader("session-2", "Yuki", 30.0, standard_figure(), 10**15, "yuki")
    running = asyncio.create_task(operation.run())
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            # the operation subscribes meanwhile
            while not slots.is_encoding.is_set():
                context.bus.publish(PERFORMANCE_SUBJECT, HEADER.id.encode())
                await asyncio.sleep(0.05)
            store = context.motion_store.performances
            await store.put_part(
                "session-2", "c-0", b"".join(pack_sample(10**15 + k, REST).pack() for k in (0, 40_000))
            )
            await store.put_header(other)
            while await context.catalogue.get_motion(other.motion) is None:
                context.bus.publish(PERFORMANCE_SUBJECT, b"session-2")
                await asyncio.sleep(0.05)
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
    assert await context.catalogue.get_motion(HEADER.motion) is None


async def test_failed_encoding_keeps_the_samples_and_is_not_repeated(
    context: ServiceContext, wall_clock: WallClock
) -> None:
    slots = FailingSlots()
    operation = PerformanceOperation(context, slots, wall_clock)
    await perform(context)
    wall_clock.ahead_s = ABANDONED_AFTER_S + 10
    for _ in range(2):
        await operation.make_motions()
    assert slots.jobs == 1
    assert set(await context.motion_store.performances.list_performances()) == {HEADER.id}
