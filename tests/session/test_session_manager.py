from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.messaging.replica_registry import ReplicaTiming
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session.schema import SessionEdit
from bunraku.session.session_manager import SessionManager
from bunraku.session.stage_proxy import StageProxy
from bunraku.wire.messages import Claim, Grant, Presence, Put, TimelineState, Welcome, unpack
from bunraku.wire.overlay import Overlay
from tests.session.recording_puppeteer import RecordingPuppeteer
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion

MOTIONS = ("one", "two")


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path)) as opened:
        for seed, name in enumerate(MOTIONS):
            encoded = encode_motion(random_motion(2.0 + seed, 30.0, seed), error_bounds_mm=(30.0,), grade="live")
            await opened.motion_store.put(name, pack_motion(name, encoded))
        yield opened


TIMING = ReplicaTiming(heartbeat_s=0.1, timeout_s=0.5)


class Replica:
    """Session manager of a replica, which can be closed or killed."""

    def __init__(self, context: ServiceContext, timing: ReplicaTiming = TIMING) -> None:
        self.sessions = SessionManager(context, timing)
        self._running = asyncio.create_task(self.sessions.run())

    async def close(self) -> None:
        self._running.cancel()
        await asyncio.wait((self._running,))
        await self.sessions.close()

    async def kill(self) -> None:
        """Stop responding as a dead process does: the records in the key-value store stay."""
        self._running.cancel()
        await asyncio.wait((self._running,))
        for session in tuple(self.sessions._endpoints):
            await self.sessions._close_stage(session)


@pytest.fixture
async def replicas(context: ServiceContext) -> AsyncIterator[list[Replica]]:
    started = [Replica(context), Replica(context)]
    yield started
    for replica in started:
        await replica.close()


class SessionMessages:
    """Messages published about a session."""

    def __init__(self, context: ServiceContext, session: str) -> None:
        self.messages: list[object] = []
        self._more = asyncio.Event()
        for subject in ("timeline", "presence", "overlay"):
            context.bus.subscribe(f"session.{session}.{subject}", self._receive)

    def _receive(self, message: bytes) -> None:
        self.messages.append(unpack(message))
        self._more.set()

    async def wait_for(self, kind: type) -> object:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not (found := [m for m in self.messages if isinstance(m, kind)]):
                self._more.clear()
                await self._more.wait()
        return found[0]


async def join_session(context: ServiceContext, stage: StageProxy, name: str) -> RecordingPuppeteer:
    connection = RecordingPuppeteer()
    context.bus.subscribe(stage.outgoing_subject(connection), connection.send)
    await stage.join(connection, name)
    return connection


def received(connection: RecordingPuppeteer, kind: type) -> list[object]:
    return [message for message in map(unpack, connection.queued) if isinstance(message, kind)]


async def test_any_replica_reaches_a_session(context: ServiceContext, replicas: list[Replica]) -> None:
    owner, other = (replica.sessions for replica in replicas)
    opened = await owner.open_session("one", playing=False)
    stage = other.stage_proxy(opened["id"])
    assert await stage.describe() == opened
    edited = await stage.edit(SessionEdit(position=300_000, motion="two"))
    assert (edited["motion"], edited["position"]) == ("two", 300_000)
    with pytest.raises(ProblemError) as refused:
        await stage.edit(SessionEdit(motion="three"))
    assert (refused.value.status, refused.value.extra["field"]) == (404, "motion")
    ben = await join_session(context, stage, "Ben")
    assert received(ben, Welcome)
    stage.send(ben, Claim(2).pack())
    assert received(ben, Grant)
    assert (await owner.stage_proxy(opened["id"]).describe())["limbs"] == [None, None, ben.id, None]
    stage.send(ben, None)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        # on a slow machine the last message has its turn in a later iteration of the event loop
        while (await stage.describe())["puppeteers"]:  # noqa: ASYNC110
            await asyncio.sleep(0)
    second = await other.open_session("one")
    for manager in (owner, other):
        items, cursor = await manager.list_sessions(1, None)
        rest, end_cursor = await manager.list_sessions(1, cursor)
        assert ([one["id"] for one in items + rest], end_cursor) == ([opened["id"], second["id"]], None)
    await stage.end()
    with pytest.raises(ProblemError) as ended:
        await owner.stage_proxy(opened["id"]).describe()
    assert ended.value.status == 404
    assert [one["id"] for one in (await owner.list_sessions(5, None))[0]] == [second["id"]]


async def test_replica_takes_over_sessions_of_a_dead_replica(context: ServiceContext, replicas: list[Replica]) -> None:
    dead, surviving = replicas
    opened = await dead.sessions.open_session("one")
    stage = surviving.sessions.stage_proxy(opened["id"])
    fittings = {"crowd": {"left_leg": "median"}, "props": {"2": "fan"}}
    before = await stage.edit(
        SessionEdit.model_validate({"motion": "two", "position": 100_000, "playing": False, **fittings})
    )
    assert before["props"][0]["kind"] == "fan"
    ben = await join_session(context, stage, "Ben")
    stage.send(ben, Claim(0).pack())
    assert received(ben, Grant)
    published = SessionMessages(context, opened["id"])
    await dead.kill()
    ben.is_unknown = False
    state, presence = [await published.wait_for(kind) for kind in (TimelineState, Presence)]
    assert isinstance(state, TimelineState)
    assert (state.motion, state.position, state.playing, state.epoch) == ("two", 100_000, False, before["epoch"])
    assert isinstance(presence, Presence)
    assert presence.limbs == [None] * 4
    # the last messages of the dead replica may have been received after the kill began
    last = [m for m in published.messages if isinstance(m, Overlay)][-1]
    assert last.limbs == {}
    after = await stage.describe()
    assert {**after, "limbs": [], "puppeteers": []} == {**before, "limbs": [], "puppeteers": []}
    # a puppeteer with an open connection is asked to reconnect
    stage.send(ben, Claim(0).pack())
    assert ben.is_unknown
    assert len(received(ben, Grant)) == 1
    assert dead.sessions.counters.sessions == {("opened",): 1, ("taken over",): 0, ("handed on",): 0}
    assert surviving.sessions.counters.sessions == {("opened",): 0, ("taken over",): 1, ("handed on",): 0}


async def test_closing_replica_hands_over_its_sessions_at_once(context: ServiceContext) -> None:
    ending, staying = (Replica(context, ReplicaTiming(heartbeat_s=0.1, timeout_s=1000.0)) for _ in range(2))
    opened = await ending.sessions.open_session("one")
    published = SessionMessages(context, opened["id"])
    stage = staying.sessions.stage_proxy(opened["id"])
    await stage.edit(SessionEdit.model_validate({"props": {"2": "fan"}}))
    ben = await join_session(context, stage, "Ben")
    stage.send(ben, Put(2, limb=1).pack())
    assert (await stage.describe())["props"][0]["limb"] == 1
    await ending.close()
    assert ben.is_unknown
    await published.wait_for(TimelineState)
    after = await stage.describe()
    assert (after["motion"], after["props"][0]["limb"]) == ("one", 1)
    assert ending.sessions.counters.sessions["handed on",] == staying.sessions.counters.sessions["taken over",] == 1
    await staying.close()


async def test_resumed_replica_closes_stages_that_were_taken_over(
    context: ServiceContext, replicas: list[Replica]
) -> None:
    stalled, surviving = replicas
    opened = await stalled.sessions.open_session("one")
    published = SessionMessages(context, opened["id"])
    endpoint = stalled.sessions._endpoints[opened["id"]]
    stalled._running.cancel()
    await asyncio.wait((stalled._running,))
    await published.wait_for(TimelineState)
    stalled._running = asyncio.create_task(stalled.sessions.run())
    await asyncio.wait((endpoint.stage._tick_task,))
    assert opened["id"] not in stalled.sessions._endpoints
    assert (await surviving.sessions.stage_proxy(opened["id"]).describe())["id"] == opened["id"]


async def test_edit_at_a_replica_that_lost_the_session_is_refused(
    context: ServiceContext, replicas: list[Replica]
) -> None:
    stalled, surviving = replicas
    opened = await stalled.sessions.open_session("one")
    published = SessionMessages(context, opened["id"])
    stalled._running.cancel()
    await asyncio.wait((stalled._running,))
    await published.wait_for(TimelineState)
    stage = stalled.sessions._endpoints[opened["id"]].stage
    with pytest.raises(ProblemError) as refused:
        await stalled.sessions.save_record(stage, stage.timeline, stage.cast)
    assert refused.value.status == 503
    assert (await surviving.sessions.stage_proxy(opened["id"]).describe())["id"] == opened["id"]
    assert opened["id"] not in stalled.sessions._endpoints


async def test_session_without_a_replica_gives_503(replicas: list[Replica]) -> None:
    dead, surviving = replicas
    opened = await dead.sessions.open_session("one")
    surviving._running.cancel()
    await dead.kill()
    with pytest.raises(ProblemError) as unavailable:
        await surviving.sessions.stage_proxy(opened["id"]).describe()
    assert unavailable.value.status == 503
    assert (await surviving.sessions.list_sessions(5, None))[0] == []


async def test_session_of_a_removed_motion_ends_with_its_replica(
    context: ServiceContext, replicas: list[Replica]
) -> None:
    dead, surviving = replicas
    opened = await dead.sessions.open_session("one")
    await context.motion_store.remove("one")
    await dead.kill()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while await context.key_values.get(f"sessions.{opened['id']}") is not None:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    with pytest.raises(ProblemError) as ended:
        await surviving.sessions.stage_proxy(opened["id"]).describe()
    assert ended.value.status == 404


async def test_outage_of_the_key_value_store_moves_no_session(
    context: ServiceContext, replicas: list[Replica], monkeypatch: pytest.MonkeyPatch
) -> None:
    owner, other = replicas
    opened = await owner.sessions.open_session("one")
    published = SessionMessages(context, opened["id"])
    put, refused = context.key_values.put, asyncio.Event()
    failures = 0

    async def fail(*_: object) -> int:
        nonlocal failures
        failures += 1
        if failures > 12:
            refused.set()
        raise ConnectionError("unavailable")

    monkeypatch.setattr(context.key_values, "put", fail)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await refused.wait()
    monkeypatch.setattr(context.key_values, "put", put)
    revisions: set[int] = set()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while len(revisions) < 10:
            entries = context.key_values.watch().entries
            revisions |= {entry.revision for key, entry in entries.items() if key.startswith("replicas.")}
            await asyncio.sleep(0)
    assert not [m for m in published.messages if isinstance(m, TimelineState)]
    assert list(owner.sessions._endpoints) == [opened["id"]]
    assert not other.sessions._endpoints
    with contextlib.suppress(ProblemError):
        await other.sessions.stage_proxy(opened["id"]).end()
