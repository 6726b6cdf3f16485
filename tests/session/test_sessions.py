from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.library import pack
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.codec.encode import encode_motion
from bunraku.session import sessions
from bunraku.session.distant import DistantStage
from bunraku.session.requests import SessionEdit
from bunraku.session.sessions import Sessions
from bunraku.session.visitor import Visitor
from bunraku.wire.messages import Claim, Grant, Presence, TimelineState, Welcome, unpack
from bunraku.wire.overlay import Overlay
from tests.vectors.blocks import wandering_motion

MOTIONS = ("one", "two")


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[Backing]:
    async with open_backing(Settings(data=tmp_path)) as opened:
        for seed, name in enumerate(MOTIONS):
            encoded = encode_motion(wandering_motion(2.0 + seed, 30.0, seed), ladder=(30.0,), grade="live")
            await opened.library.put(name, pack(name, encoded))
        yield opened


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "BEAT", 0.1)
    monkeypatch.setattr(sessions, "EXPIRED", 0.5)


class Replica:
    """One replica's sessions, until it is closed, or killed."""

    def __init__(self, backing: Backing) -> None:
        self.sessions = Sessions(backing)
        self._running = asyncio.create_task(self.sessions.run())

    async def close(self) -> None:
        self._running.cancel()
        await asyncio.wait((self._running,))
        await self.sessions.close()

    async def kill(self) -> None:
        """What a dead process leaves: nothing of it answers, and the register says what it said."""
        self._running.cancel()
        await asyncio.wait((self._running,))
        for session in tuple(self.sessions._doors):
            await self.sessions._let_go(session)


@pytest.fixture
async def replicas(backing: Backing) -> AsyncIterator[list[Replica]]:
    both = [Replica(backing), Replica(backing)]
    yield both
    for replica in both:
        await replica.close()


class Heard:
    """What is published about one session."""

    def __init__(self, backing: Backing, session: str) -> None:
        self.messages: list[object] = []
        self._more = asyncio.Event()
        for word in ("timeline", "presence", "overlay"):
            backing.bus.subscribe(f"session.{session}.{word}", self._hear)

    def _hear(self, message: bytes) -> None:
        self.messages.append(unpack(message))
        self._more.set()

    async def first(self, kind: type) -> object:
        async with asyncio.timeout(20):
            while not (found := [m for m in self.messages if isinstance(m, kind)]):
                self._more.clear()
                await self._more.wait()
        return found[0]


async def come(backing: Backing, stage: DistantStage, name: str) -> Visitor:
    visitor = Visitor()
    backing.bus.subscribe(stage.told(visitor), visitor.tell)
    await stage.join(visitor, name)
    return visitor


def told(visitor: Visitor, kind: type) -> list[object]:
    return [message for message in map(unpack, visitor.waiting) if isinstance(message, kind)]


async def test_any_replica_reaches_a_session(backing: Backing, replicas: list[Replica]) -> None:
    owner, other = (replica.sessions for replica in replicas)
    opened = await owner.open("one", playing=False)
    stage = other.stage(opened["id"])
    assert await stage.describe() == opened
    edited = await stage.edit(SessionEdit(position=300_000, motion="two"))
    assert (edited["motion"], edited["position"]) == ("two", 300_000)
    with pytest.raises(ProblemError) as refused:
        await stage.edit(SessionEdit(motion="three"))
    assert (refused.value.status, refused.value.extra["field"]) == (404, "motion")
    ben = await come(backing, stage, "Ben")
    assert told(ben, Welcome)
    stage.say(ben, Claim(2).pack())
    assert told(ben, Grant)
    assert (await owner.stage(opened["id"]).describe())["limbs"] == [None, None, ben.id, None]
    stage.say(ben, None)
    assert (await stage.describe())["puppeteers"] == []
    second = await other.open("one")
    for asked in (owner, other):
        items, following = await asked.page(1, None)
        rest, end = await asked.page(1, following)
        assert ([one["id"] for one in items + rest], end) == ([opened["id"], second["id"]], None)
    await stage.end()
    with pytest.raises(ProblemError) as ended:
        await owner.stage(opened["id"]).describe()
    assert ended.value.status == 404
    assert [one["id"] for one in (await owner.page(5, None))[0]] == [second["id"]]


async def test_another_replica_goes_on_with_the_sessions_of_one_that_died(
    backing: Backing, replicas: list[Replica]
) -> None:
    dead, living = replicas
    opened = await dead.sessions.open("one")
    stage = living.sessions.stage(opened["id"])
    before = await stage.edit(SessionEdit(motion="two", position=100_000, playing=False))
    ben = await come(backing, stage, "Ben")
    stage.say(ben, Claim(0).pack())
    assert told(ben, Grant)
    heard = Heard(backing, opened["id"])
    await dead.kill()
    ben.gone = False
    state, presence = [await heard.first(kind) for kind in (TimelineState, Presence)]
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
    stage.say(ben, Claim(0).pack())
    assert ben.gone
    assert len(told(ben, Grant)) == 1
    assert dead.sessions.tally.sessions == {("opened",): 1, ("taken over",): 0, ("handed on",): 0}
    assert living.sessions.tally.sessions == {("opened",): 0, ("taken over",): 1, ("handed on",): 0}


async def test_one_that_ends_in_order_leaves_its_sessions_at_once(
    backing: Backing, replicas: list[Replica], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sessions, "EXPIRED", 1000.0)
    ending, staying = replicas
    opened = await ending.sessions.open("one")
    heard = Heard(backing, opened["id"])
    ben = await come(backing, staying.sessions.stage(opened["id"]), "Ben")
    await ending.close()
    assert ben.gone
    await heard.first(TimelineState)
    assert (await staying.sessions.stage(opened["id"]).describe())["motion"] == "one"
    assert ending.sessions.tally.sessions["handed on",] == staying.sessions.tally.sessions["taken over",] == 1


async def test_one_that_stood_still_finds_its_sessions_elsewhere(backing: Backing, replicas: list[Replica]) -> None:
    still, living = replicas
    opened = await still.sessions.open("one")
    heard = Heard(backing, opened["id"])
    still._running.cancel()
    await asyncio.wait((still._running,))
    await heard.first(TimelineState)
    with pytest.raises(ProblemError) as refused:
        await still.sessions.note(still.sessions._doors[opened["id"]].stage)
    assert refused.value.status == 503
    door = still.sessions._doors[opened["id"]]
    still._running = asyncio.create_task(still.sessions.run())
    await asyncio.wait((door.stage._ticking,))
    assert (await living.sessions.stage(opened["id"]).describe())["id"] == opened["id"]
    assert opened["id"] not in still.sessions._doors


async def test_a_session_between_two_replicas_is_to_be_asked_again(replicas: list[Replica]) -> None:
    dead, living = replicas
    opened = await dead.sessions.open("one")
    living._running.cancel()
    await dead.kill()
    with pytest.raises(ProblemError) as moving:
        await living.sessions.stage(opened["id"]).describe()
    assert moving.value.status == 503
    assert (await living.sessions.page(5, None))[0] == []


async def test_a_session_whose_motion_is_gone_ends_with_its_replica(backing: Backing, replicas: list[Replica]) -> None:
    dead, living = replicas
    opened = await dead.sessions.open("one")
    await backing.library.remove("one")
    await dead.kill()
    async with asyncio.timeout(20):
        while await backing.register.get(f"sessions.{opened['id']}") is not None:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    with pytest.raises(ProblemError) as ended:
        await living.sessions.stage(opened["id"]).describe()
    assert ended.value.status == 404


async def test_a_register_that_is_gone_for_a_while_takes_nothing_away(
    backing: Backing, replicas: list[Replica], monkeypatch: pytest.MonkeyPatch
) -> None:
    owner, other = replicas
    opened = await owner.sessions.open("one")
    heard = Heard(backing, opened["id"])
    put, refused = backing.register.put, asyncio.Event()
    failures = 0

    async def failing(*_: object) -> int:
        nonlocal failures
        failures += 1
        if failures > 12:
            refused.set()
        raise ConnectionError("away")

    monkeypatch.setattr(backing.register, "put", failing)
    async with asyncio.timeout(20):
        await refused.wait()
    monkeypatch.setattr(backing.register, "put", put)
    counts: set[int] = set()
    async with asyncio.timeout(20):
        while len(counts) < 10:
            counts |= {one.revision for one in (await backing.register.all("replicas")).values()}
            await asyncio.sleep(0)
    assert not [m for m in heard.messages if isinstance(m, TimelineState)]
    assert list(owner.sessions._doors) == [opened["id"]]
    assert not other.sessions._doors
    with contextlib.suppress(ProblemError):
        await other.sessions.stage(opened["id"]).end()
