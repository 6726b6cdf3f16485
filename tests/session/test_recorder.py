from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import msgpack
import pytest

from bunraku.messaging.recording_request import RECORDING_SUBJECT
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session import recorder
from bunraku.session.recording import PackedRecording
from bunraku.session.stage_proxy import StageProxy
from tests.time_limit import HANG_TIMEOUT_S

RECORDING = PackedRecording(None, None, b"")


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path)) as opened:
        yield opened


@pytest.fixture
async def stage(context: ServiceContext) -> StageProxy:
    """Return the proxy of a stage with a log."""

    async def store_log(_: bytes) -> bytes:
        await context.motion_store.put_log("log", b"1")
        packed: bytes = msgpack.packb({"answer": {"log": "log", "begin": 0, "end": 1}})
        return packed

    context.bus.serve("session.s.log", store_log)
    return StageProxy("s", context.bus, context.key_values)


async def test_answer_of_the_ingest_service_is_returned(context: ServiceContext, stage: StageProxy) -> None:
    async def record(_: bytes) -> bytes:
        packed: bytes = msgpack.packb({"motion": {"id": "m"}})
        return packed

    context.bus.serve(RECORDING_SUBJECT, record)
    assert await recorder.record_session(stage, RECORDING, context) == {"id": "m"}
    assert await context.motion_store.get_log("log") is None
    assert context.key_values.watch().entries == {}


async def test_death_of_the_recording_replica_ends_the_request(context: ServiceContext, stage: StageProxy) -> None:
    async def die(_: bytes) -> bytes:
        # a replica that is no longer registered holds the lease
        await context.key_values.put("recordings.log", b"dead")
        await asyncio.get_running_loop().create_future()
        raise AssertionError

    context.bus.serve(RECORDING_SUBJECT, die)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with pytest.raises(ProblemError) as raised:
            await recorder.record_session(stage, RECORDING, context)
    assert raised.value.status == 503
    assert await context.motion_store.get_log("log") is None


async def test_missing_ingest_service_is_a_problem(context: ServiceContext, stage: StageProxy) -> None:
    with pytest.raises(ProblemError) as raised:
        await recorder.record_session(stage, RECORDING, context)
    assert raised.value.status == 503


async def test_unavailable_backend_of_the_ingest_service_is_reported(
    context: ServiceContext, stage: StageProxy
) -> None:
    async def fail(_: bytes) -> bytes:
        raise BackendUnavailable("the library", "it does not answer")

    context.bus.serve(RECORDING_SUBJECT, fail)
    with pytest.raises(BackendUnavailable, match="library"):
        await recorder.record_session(stage, RECORDING, context)
