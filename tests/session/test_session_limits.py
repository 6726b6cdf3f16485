"""Limits on sessions: per subject over all replicas, and the end of idle sessions while a replica is full."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import AsyncIterator
from pathlib import Path
from random import Random
from typing import Any

import msgpack
import pytest
from pydantic import SecretStr

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.messaging.key_value import MemoryKeyValueStore
from bunraku.playout import timeline
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session import session_manager
from bunraku.session.live.cast import EMPTY_CAST
from bunraku.session.session_manager import SessionManager
from bunraku.session.session_registry import SessionRecord, session_key
from bunraku.session.stage import Stage
from tests.credentials import SECRET
from tests.session.remote_store import RemoteKeyValueStore
from tests.vectors.blocks import random_motion

QUOTA = 3


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path, secret=SecretStr(SECRET), quota_sessions=QUOTA)) as opened:
        encoded = encode_motion(random_motion(2.0, 30.0, 0), error_bounds_mm=(30.0,), grade="live")
        await opened.motion_store.put("one", pack_motion("one", encoded))
        yield opened


@pytest.fixture
async def managers(context: ServiceContext) -> AsyncIterator[list[SessionManager]]:
    """Return two replicas whose connections to the key-value store are slow."""
    server, random = MemoryKeyValueStore(), Random(1)
    stores = [RemoteKeyValueStore(server, random, 0.02) for _ in range(2)]
    started = [SessionManager(dataclasses.replace(context, key_values=store)) for store in stores]
    running = [asyncio.create_task(manager.run()) for manager in started]
    yield started
    for task in running:
        task.cancel()
    await asyncio.gather(*running, return_exceptions=True)
    for manager in started:
        await manager.close()
    for store in stores:
        await store.close()


async def open_session(manager: SessionManager, subject: str) -> str:
    session: str = (await manager.open_session("one", subject=subject))["id"]
    return session


async def test_quota_counts_the_sessions_of_all_replicas(managers: list[SessionManager]) -> None:
    one, two = managers
    opened = [await open_session(manager, "aiko") for manager in (one, two, one)]
    for manager in managers:
        with pytest.raises(ProblemError, match="aiko has 3 open sessions") as refused:
            await open_session(manager, "aiko")
        assert (refused.value.status, refused.value.title) == (403, "Quota used up")
        await open_session(manager, "ben")
    await one.stage_proxy(opened[1]).end()
    await open_session(two, "aiko")


async def test_concurrent_requests_do_not_exceed_the_quota(managers: list[SessionManager]) -> None:
    attempts = [open_session(manager, "aiko") for manager in managers * 8]
    results = await asyncio.gather(*attempts, return_exceptions=True)
    assert all(isinstance(result, str | ProblemError) for result in results)
    sessions = [result for result in results if isinstance(result, str)]
    assert len(sessions) <= QUOTA
    listed, _ = await managers[0].list_sessions(50, None)
    assert sorted(session["id"] for session in listed) == sorted(sessions)
    # a refused session does not count
    for _ in range(QUOTA - len(sessions)):
        await open_session(managers[1], "aiko")


async def test_unnamed_subject_has_a_quota_too(managers: list[SessionManager]) -> None:
    for _ in range(QUOTA):
        await open_session(managers[0], "")
    with pytest.raises(ProblemError, match="this client has 3"):
        await open_session(managers[1], "")


async def test_openings_of_one_subject_are_limited(context: ServiceContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_manager, "OPENING_BURST", 3)
    # the clock stands still: a slow machine gets no tokens back between the openings
    now = context.clock()
    manager = SessionManager(dataclasses.replace(context, clock=lambda: now))
    for _ in range(3):
        await manager.end_session(await open_session(manager, "aiko"))
    with pytest.raises(ProblemError, match="too often") as refused:
        await open_session(manager, "aiko")
    assert refused.value.status == 429
    await open_session(manager, "ben")
    # without access control there are no subjects
    for _ in range(6):
        await manager.open_session("one")
    await manager.close()


async def test_stages_are_created_in_separate_iterations_of_the_event_loop(
    context: ServiceContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thousand requests at once do not block the overlays of other sessions."""
    manager, iteration, created_in = SessionManager(context), 0, []

    async def count_iterations() -> None:
        nonlocal iteration
        while True:
            iteration += 1
            await asyncio.sleep(0)

    def create_stage(*args: Any) -> Stage:
        created_in.append(iteration)
        return Stage(*args)

    monkeypatch.setattr(session_manager, "Stage", create_stage)
    counting = asyncio.create_task(count_iterations())
    await asyncio.gather(*(manager.open_session("one") for _ in range(20)))
    counting.cancel()
    assert len(created_in) == len(set(created_in)) == 20
    await manager.close()


@pytest.fixture
async def full(
    context: ServiceContext, monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[tuple[SessionManager, list[str]]]:
    """Return a replica without quota whose four places the subject `hog` has taken, oldest first."""
    monkeypatch.setattr(session_manager, "MAX_SESSIONS", 4)
    monkeypatch.setattr(session_manager, "IDLE_GRACE_US", 0)
    settings = context.settings.model_copy(update={"quota_sessions": 0})
    manager = SessionManager(dataclasses.replace(context, settings=settings))
    yield manager, [await open_session(manager, "hog") for _ in range(4)]
    await manager.close()


def session_ids(manager: SessionManager) -> set[str]:
    return {stage.id for stage in manager.stages}


async def test_idle_sessions_of_the_largest_subject_end_first(
    full: tuple[SessionManager, list[str]], context: ServiceContext
) -> None:
    manager, hogged = full
    # the oldest has a viewer and stays
    context.bus.publish(f"session.{hogged[0]}.viewers", msgpack.packb(["stream", 1]))
    first = await open_session(manager, "aiko")
    assert session_ids(manager) == {hogged[0], *hogged[2:], first}
    second = await open_session(manager, "aiko")
    assert session_ids(manager) == {hogged[0], hogged[3], first, second}
    with pytest.raises(ProblemError) as ended:
        await manager.stage_proxy(hogged[1]).describe()
    assert ended.value.status == 404
    # two each: nobody has more than the others, and the session idle for longest ends
    context.bus.publish(f"session.{hogged[3]}.viewers", msgpack.packb(["stream", 1]))
    third = await open_session(manager, "aiko")
    assert session_ids(manager) == {hogged[0], hogged[3], second, third}


async def test_subject_cannot_end_the_sessions_of_smaller_ones(
    full: tuple[SessionManager, list[str]], context: ServiceContext
) -> None:
    manager, hogged = full
    aiko = await open_session(manager, "aiko")
    for session in hogged[1:]:
        context.bus.publish(f"session.{session}.viewers", msgpack.packb(["stream", 1]))
    with pytest.raises(ProblemError, match="4 open sessions") as refused:
        await open_session(manager, "hog")
    assert refused.value.status == 503
    assert session_ids(manager) == {*hogged[1:], aiko}


async def test_new_session_is_not_idle_yet(
    full: tuple[SessionManager, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_manager, "IDLE_GRACE_US", 3_600_000_000)
    manager, hogged = full
    with pytest.raises(ProblemError) as refused:
        await open_session(manager, "aiko")
    assert refused.value.status == 503
    assert session_ids(manager) == set(hogged)


async def test_records_of_earlier_and_later_releases_are_read() -> None:
    state = timeline.start("one", 2_000_000, 5).pack()
    assert SessionRecord.unpack(msgpack.packb(["owner", 5, state])) == SessionRecord("owner", 5, state, "")
    later = SessionRecord.unpack(msgpack.packb(["owner", 5, state, "aiko", EMPTY_CAST.to_values(), {"more": 1}]))
    assert later == SessionRecord("owner", 5, state, "aiko")
    # what a replica of the first release can read
    assert msgpack.unpackb(SessionRecord("owner", 5, state).pack()) == ["owner", 5, state]
    assert msgpack.unpackb(SessionRecord("owner", 5, state, "aiko").pack()) == ["owner", 5, state, "aiko"]
    for wrong in (b"its last timeline", msgpack.packb(["owner", 5]), msgpack.packb(["owner", 5, b"\x03"])):
        with pytest.raises((ValueError, TypeError)):
            SessionRecord.unpack(wrong)


async def test_unreadable_record_affects_no_other_session(
    managers: list[SessionManager], caplog: pytest.LogCaptureFixture
) -> None:
    one, two = managers
    await one._context.key_values.put(session_key("odd"), b"its last timeline")
    session = await open_session(one, "aiko")
    assert [found["id"] for found in (await two.list_sessions(10, None))[0]] == [session]
    assert "odd is ignored" in caplog.text
