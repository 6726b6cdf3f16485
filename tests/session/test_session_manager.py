from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session import session_manager
from bunraku.session.puppeteer_connection import PuppeteerConnection
from bunraku.session.schema import SessionEdit
from bunraku.session.session_manager import SessionManager
from bunraku.session.stage_proxy import StageProxy
from bunraku.wire.messages import Claim, Grant, Presence, TimelineState, Welcome, unpack
from bunraku.wire.overlay import Overlay
from tests.vectors.blocks import random_motion

MOTIONS = ("one", "two")


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path)) as opened:
        for seed, name in enumerate(MOTIONS):
            encoded = encode_motion(random_motion(2.0 + seed, 30.0, seed), error_bounds_mm=(30.0,), grade="live")
            await opened.motion_store.put(name, pack_motion(name, encoded))
        yield opened


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_manager, "HEARTBEAT_INTERVAL_S", 0.1)
    monkeypatch.setattr(session_manager, "REPLICA_TIMEOUT_S", 0.5)


class Replica:
    """One replica's sessions, until it is closed, or killed."""

    def __init__(self, backing: ServiceContext) -> None:
        self.sessions = SessionManager(backing)
        self._running = asyncio.create_task(self.sessions.run())

    async def close(self) -> None:
        self._running.cancel()
        await asyncio.wait((self._running,))
        await self.sessions.close()

    async def kill(self) -> None:
        """What a dead process leaves: nothing of it answers, and the register says what it said."""
        self._running.cancel()
        await asyncio.wait((self._running,))
        for session in tuple(self.sessions._endpoints):
            await self.sessions._close_stage(session)


@pytest.fixture
async def replicas(backing: ServiceContext) -> AsyncIterator[list[Replica]]:
    both = [Replica(backing), Replica(backing)]
    yield both
    for replica in both:
        await replica.close()


class SessionMessages:
    """What is published about one session."""

    def __init__(self, backing: ServiceContext, session: str) -> None:
        self.messages: list[object] = []
        self._more = asyncio.Event()
        for word in ("timeline", "presence", "overlay"):
            backing.bus.subscribe(f"session.{session}.{word}", self._receive)

    def _receive(self, message: bytes) -> None:
        self.messages.append(unpack(message))
        self._more.set()

    async def wait_for(self, kind: type) -> object:
        async with asyncio.timeout(20):
            while not (found := [m for m in self.messages if isinstance(m, kind)]):
                self._more.clear()
                await self._more.wait()
        return found[0]


async def join_session(context: ServiceContext, stage: StageProxy, name: str) -> PuppeteerConnection:
    visitor = PuppeteerConnection()
    context.bus.subscribe(stage.outgoing_subject(visitor), visitor.send)
    await stage.join(visitor, name)
    return visitor


def received(connection: PuppeteerConnection, kind: type) -> list[object]:
    return [message for message in map(unpack, connection.queued) if isinstance(message, kind)]


async def test_any_replica_reaches_a_session(backing: ServiceContext, replicas: list[Replica]) -> None:
    owner, other = (replica.sessions for replica in replicas)
    opened = await owner.open_session("one", playing=False)
    stage = other.stage_proxy(opened["id"])
    assert await stage.describe() == opened
    edited = await stage.edit(SessionEdit(position=300_000, motion="two"))
    assert (edited["motion"], edited["position"]) == ("two", 300_000)
    with pytest.raises(ProblemError) as refused:
        await stage.edit(SessionEdit(motion="three"))
    assert (refused.value.status, refused.value.extra["field"]) == (404, "motion")
    ben = await join_session(backing, stage, "Ben")
    assert received(ben, Welcome)
    stage.send(ben, Claim(2).pack())
    assert received(ben, Grant)
    assert (await owner.stage_proxy(opened["id"]).describe())["limbs"] == [None, None, ben.id, None]
    stage.send(ben, None)
    assert (await stage.describe())["puppeteers"] == []
    second = await other.open_session("one")
    for asked in (owner, other):
        items, following = await asked.list_sessions(1, None)
        rest, end = await asked.list_sessions(1, following)
        assert ([one["id"] for one in items + rest], end) == ([opened["id"], second["id"]], None)
    await stage.end()
    with pytest.raises(ProblemError) as ended:
        await owner.stage_proxy(opened["id"]).describe()
    assert ended.value.status == 404
    assert [one["id"] for one in (await owner.list_sessions(5, None))[0]] == [second["id"]]


async def test_another_replica_goes_on_with_the_sessions_of_one_that_died(
    backing: ServiceContext, replicas: list[Replica]
) -> None:
    dead, living = replicas
    opened = await dead.sessions.open_session("one")
    stage = living.sessions.stage_proxy(opened["id"])
    before = await stage.edit(SessionEdit(motion="two", position=100_000, playing=False))
    ben = await join_session(backing, stage, "Ben")
    stage.send(ben, Claim(0).pack())
    assert received(ben, Grant)
    heard = SessionMessages(backing, opened["id"])
    await dead.kill()
    ben.is_unknown = False
    state, presence = [await heard.wait_for(kind) for kind in (TimelineState, Presence)]
    assert isinstance(state, TimelineState)
    assert (state.motion, state.position, state.playing, state.epoch) == ("two", 100_000, False, before["epoch"])
    assert isinstance(presence, Presence)
    assert presence.limbs == [None] * 4
    # the last of what the dead one said may have come after the kill began
    last = [m for m in heard.messages if isinstance(m, Overlay)][-1]
    assert last.limbs == {}
    after = await stage.describe()
    assert {**after, "limbs": [], "puppeteers": []} == {**before, "limbs": [], "puppeteers": []}
    # who came through a door that still stands is told to come again
    stage.send(ben, Claim(0).pack())
    assert ben.is_unknown
    assert len(received(ben, Grant)) == 1
    assert dead.sessions.counters.sessions == {("opened",): 1, ("taken over",): 0, ("handed on",): 0}
    assert living.sessions.counters.sessions == {("opened",): 0, ("taken over",): 1, ("handed on",): 0}


async def test_one_that_ends_in_order_leaves_its_sessions_at_once(
    backing: ServiceContext, replicas: list[Replica], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_manager, "REPLICA_TIMEOUT_S", 1000.0)
    ending, staying = replicas
    opened = await ending.sessions.open_session("one")
    heard = SessionMessages(backing, opened["id"])
    ben = await join_session(backing, staying.sessions.stage_proxy(opened["id"]), "Ben")
    await ending.close()
    assert ben.is_unknown
    await heard.wait_for(TimelineState)
    assert (await staying.sessions.stage_proxy(opened["id"]).describe())["motion"] == "one"
    assert ending.sessions.counters.sessions["handed on",] == staying.sessions.counters.sessions["taken over",] == 1


async def test_one_that_stood_still_finds_its_sessions_elsewhere(
    backing: ServiceContext, replicas: list[Replica]
) -> None:
    still, living = replicas
    opened = await still.sessions.open_session("one")
    heard = SessionMessages(backing, opened["id"])
    still._running.cancel()
    await asyncio.wait((still._running,))
    await heard.wait_for(TimelineState)
    with pytest.raises(ProblemError) as refused:
        await still.sessions.save_record(still.sessions._endpoints[opened["id"]].stage)
    assert refused.value.status == 503
    door = still.sessions._endpoints[opened["id"]]
    still._running = asyncio.create_task(still.sessions.run())
    await asyncio.wait((door.stage._tick_task,))
    assert (await living.sessions.stage_proxy(opened["id"]).describe())["id"] == opened["id"]
    assert opened["id"] not in still.sessions._endpoints


async def test_a_session_between_two_replicas_is_to_be_asked_again(replicas: list[Replica]) -> None:
    dead, living = replicas
    opened = await dead.sessions.open_session("one")
    living._running.cancel()
    await dead.kill()
    with pytest.raises(ProblemError) as moving:
        await living.sessions.stage_proxy(opened["id"]).describe()
    assert moving.value.status == 503
    assert (await living.sessions.list_sessions(5, None))[0] == []


async def test_a_session_whose_motion_is_gone_ends_with_its_replica(
    backing: ServiceContext, replicas: list[Replica]
) -> None:
    dead, living = replicas
    opened = await dead.sessions.open_session("one")
    await backing.motion_store.remove("one")
    await dead.kill()
    async with asyncio.timeout(20):
        while await backing.key_values.get(f"sessions.{opened['id']}") is not None:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    with pytest.raises(ProblemError) as ended:
        await living.sessions.stage_proxy(opened["id"]).describe()
    assert ended.value.status == 404


async def test_a_register_that_is_gone_for_a_while_takes_nothing_away(
    backing: ServiceContext, replicas: list[Replica], monkeypatch: pytest.MonkeyPatch
) -> None:
    owner, other = replicas
    opened = await owner.sessions.open_session("one")
    heard = SessionMessages(backing, opened["id"])
    put, refused = backing.key_values.put, asyncio.Event()
    failures = 0

    async def failing(*_: object) -> int:
        nonlocal failures
        failures += 1
        if failures > 12:
            refused.set()
        raise ConnectionError("away")

    monkeypatch.setattr(backing.key_values, "put", failing)
    async with asyncio.timeout(20):
        await refused.wait()
    monkeypatch.setattr(backing.key_values, "put", put)
    counts: set[int] = set()
    async with asyncio.timeout(20):
        while len(counts) < 10:
            counts |= {one.revision for one in (await backing.key_values.list_prefix("replicas")).values()}
            await asyncio.sleep(0)
    assert not [m for m in heard.messages if isinstance(m, TimelineState)]
    assert list(owner.sessions._endpoints) == [opened["id"]]
    assert not other.sessions._endpoints
    with contextlib.suppress(ProblemError):
        await other.sessions.stage_proxy(opened["id"]).end()
