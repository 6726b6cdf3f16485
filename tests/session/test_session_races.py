"""Creation, end, edit and take-over of sessions with a key-value store that answers late, or not at all."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from random import Random

import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.messaging.key_value import MemoryKeyValueStore, RevisionConflict
from bunraku.messaging.replica_registry import ReplicaTiming
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session.schema import SessionEdit
from bunraku.session.session_manager import SessionManager
from bunraku.session.session_registry import SessionRecord, session_key
from tests.session.remote_store import RemoteKeyValueStore
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion

TIMING = ReplicaTiming(heartbeat_s=0.05, timeout_s=0.4)


class Replica:
    """Session manager of a replica with a separate connection to the key-value store."""

    def __init__(self, context: ServiceContext, store: RemoteKeyValueStore) -> None:
        self.store = store
        self.sessions = SessionManager(dataclasses.replace(context, key_values=store), TIMING)
        self._running = asyncio.create_task(self.sessions.run())

    @property
    def id(self) -> str:
        return self.sessions._registry.replicas.id

    @property
    def stages(self) -> set[str]:
        return set(self.sessions._endpoints)

    async def stop(self) -> None:
        """Stop as a dead process does: the records stay."""
        self._running.cancel()
        await asyncio.wait((self._running,))
        for session in tuple(self.stages):
            await self.sessions._close_stage(session)
        await self.store.close()

    async def send_heartbeats(self, number: int) -> None:
        """Wait until the server has got `number` more heartbeats."""
        key = self.sessions._registry.replicas.key
        seen: set[int] = set()
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while len(seen) <= number:
                entry = await self.store.server.get(key)
                seen |= {entry.revision} if entry else set()
                await asyncio.sleep(0.005)


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path)) as opened:
        encoded = encode_motion(random_motion(2.0, 30.0, 0), error_bounds_mm=(30.0,), grade="live")
        await opened.motion_store.put("one", pack_motion("one", encoded))
        yield opened


@pytest.fixture
async def server() -> MemoryKeyValueStore:
    return MemoryKeyValueStore()


@pytest.fixture
async def start(context: ServiceContext, server: MemoryKeyValueStore) -> AsyncIterator[Callable[[], Replica]]:
    replicas: list[Replica] = []

    def add(random: Random | None = None, max_delay_s: float = 0.0) -> Replica:
        replicas.append(Replica(context, RemoteKeyValueStore(server, random, max_delay_s)))
        return replicas[-1]

    yield add
    for replica in replicas:
        await replica.stop()


async def wait_until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def require_gone(session: str, server: MemoryKeyValueStore, *replicas: Replica) -> None:
    """Check that a session stays away for some heartbeats of all replicas."""
    for _ in range(2):
        assert await server.get(session_key(session)) is None
        for replica in replicas:
            assert session not in replica.stages
            with pytest.raises(ProblemError) as problem:
                await replica.sessions.stage_proxy(session).describe()
            assert problem.value.status == 404
            await replica.send_heartbeats(3)


async def test_ended_session_stays_away_while_the_removal_is_late(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    owner, other = start(), start()
    session = (await owner.sessions.open_session("one"))["id"]
    owner.store.held_calls["remove sessions"] = release = asyncio.Event()
    ending = asyncio.create_task(owner.sessions.end_session(session))
    await owner.send_heartbeats(4)
    assert not ending.done()
    release.set()
    await ending
    await require_gone(session, server, owner, other)


async def test_ended_session_stays_away_while_the_watch_is_late(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    owner, other = start(), start()
    session = (await owner.sessions.open_session("one"))["id"]
    await other.send_heartbeats(2)
    for replica in (owner, other):
        replica.store.watch_released.clear()
    await owner.sessions.stage_proxy(session).end()
    # both still have the record in their copies, and act on it
    for replica in (owner, other):
        replica.sessions._review(session)
        await asyncio.sleep(0.05)
        replica.store.watch_released.set()
    await require_gone(session, server, owner, other)


async def test_removal_whose_answer_was_lost_ends_the_session(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    owner, other = start(), start()
    session = (await owner.sessions.open_session("one"))["id"]
    owner.store.lost_answers["remove sessions"] = 1
    with pytest.raises(BackendUnavailable):
        await owner.sessions.end_session(session)
    await wait_until(lambda: session not in owner.stages)
    await require_gone(session, server, owner, other)


async def test_end_that_waits_for_a_hand_over_is_not_acknowledged(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    leaving, other = start(), start()
    session = (await leaving.sessions.open_session("one"))["id"]
    leaving._running.cancel()
    await asyncio.wait((leaving._running,))
    # an edit whose answer is late
    async with leaving.sessions._endpoints[session].record_lock:
        closing = asyncio.create_task(leaving.sessions.close())
        await asyncio.sleep(0)
        ending = asyncio.create_task(leaving.sessions.end_session(session))
        await asyncio.sleep(0)
    await closing
    with pytest.raises(ProblemError) as refused:
        await ending
    assert refused.value.status == 503
    await wait_until(lambda: session in other.stages)
    await other.sessions.stage_proxy(session).end()
    await require_gone(session, server, other)


async def test_edit_of_a_replaced_stage_does_not_change_the_record(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    owner = start()
    session = (await owner.sessions.open_session("one"))["id"]
    replaced = owner.sessions._endpoints[session]
    # an edit whose answer is late
    async with replaced.record_lock:
        edited = replaced.stage.plan_edit(SessionEdit(position=300_000), None)
        assert edited is not None
        saving = asyncio.create_task(owner.sessions.save_record(replaced.stage, edited, replaced.stage.cast))
        await asyncio.sleep(0)
        await owner.sessions._close_stage(session)
        owner.sessions._review(session)
        await wait_until(lambda: session in owner.stages)
    with pytest.raises(ProblemError) as refused:
        await saving
    assert refused.value.status == 503
    entry = await server.get(session_key(session))
    assert entry is not None
    successor = owner.sessions._endpoints[session].stage
    assert SessionRecord.unpack(entry.value).parse_timeline() == successor.timeline


async def test_ends_at_the_same_time_all_succeed(start: Callable[[], Replica], server: MemoryKeyValueStore) -> None:
    owner = start()
    session = (await owner.sessions.open_session("one"))["id"]
    await asyncio.gather(*(owner.sessions.end_session(session) for _ in range(3)))
    await require_gone(session, server, owner)


async def test_edit_whose_answer_was_lost_is_followed_by_edits_and_the_end(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    owner = start()
    session = (await owner.sessions.open_session("one"))["id"]
    owner.store.watch_released.clear()
    owner.store.lost_answers["put sessions"] = 1
    stage = owner.sessions.stage_proxy(session)
    with pytest.raises(BackendUnavailable):
        await stage.edit(SessionEdit(playing=False))
    await stage.edit(SessionEdit(position=300_000))
    entry = await server.get(session_key(session))
    assert entry is not None
    assert SessionRecord.unpack(entry.value).parse_timeline().position == 300_000
    await stage.end()
    owner.store.watch_released.set()
    await require_gone(session, server, owner)


async def test_session_whose_creation_answer_was_lost_gets_a_stage_and_can_be_ended(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    owner, other = start(), start()
    owner.store.lost_answers["put sessions"] = 1
    with pytest.raises(BackendUnavailable):
        await owner.sessions.open_session("one", session="s")
    await wait_until(lambda: owner.stages == {"s"})
    await other.sessions.stage_proxy("s").end()
    await require_gone("s", server, owner, other)


async def test_session_is_not_created_twice_while_an_answer_is_late(
    start: Callable[[], Replica],
) -> None:
    one, two = start(), start()
    release = asyncio.Event()
    one.store.held_calls["put sessions"] = two.store.held_calls["put sessions"] = release
    opening = [asyncio.create_task(replica.sessions.open_session("one", session="s")) for replica in (one, two)]
    await one.send_heartbeats(2)
    release.set()
    results = await asyncio.gather(*opening, return_exceptions=True)
    assert sum(isinstance(result, dict) for result in results) == 1
    for replica in (one, two):
        await replica.send_heartbeats(3)
    assert sorted(map(len, (one.stages, two.stages))) == [0, 1]


async def test_session_that_ends_during_its_takeover_stays_away(
    start: Callable[[], Replica], server: MemoryKeyValueStore, context: ServiceContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    dead, one, two = start(), start(), start()
    session = (await dead.sessions.open_session("one"))["id"]
    loading, loaded, load = asyncio.Event(), asyncio.Event(), context.motion_store.get

    async def load_late(motion: str) -> object:
        loading.set()
        await loaded.wait()
        return await load(motion)

    monkeypatch.setattr(context.motion_store, "get", load_late)
    await dead.stop()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await loading.wait()
    with pytest.raises(ProblemError) as unavailable:
        await one.sessions.stage_proxy(session).end()
    assert unavailable.value.status == 503
    # another replica ends it, as after a take-over
    entry = await server.get(session_key(session))
    assert entry is not None
    await server.remove(session_key(session), entry.revision)
    loaded.set()
    for replica in (one, two):
        await replica.send_heartbeats(3)
    await require_gone(session, server, one, two)


async def test_stage_of_a_lost_session_is_closed_though_its_answer_is_late(
    start: Callable[[], Replica], server: MemoryKeyValueStore
) -> None:
    """The answer to the creation arrives after another replica has taken over and ended the session."""
    owner, other = start(), start()
    await owner.send_heartbeats(1)
    put = owner.store.server.put
    answer_released = asyncio.Event()

    async def put_and_answer_late(key: str, value: bytes, revision: int | None = None) -> int:
        written = await put(key, value, revision)
        if key.startswith("sessions."):
            await answer_released.wait()
        return written

    owner.store.put = put_and_answer_late  # type: ignore[method-assign]
    opening = asyncio.create_task(owner.sessions.open_session("one", session="s"))
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while await server.get("sessions.s") is None:  # noqa: ASYNC110
            await asyncio.sleep(0.005)
    entry = await server.get("sessions.s")
    assert entry is not None
    record = SessionRecord.unpack(entry.value)._replace(owner=other.id)
    await server.remove("sessions.s", await server.put("sessions.s", record.pack(), entry.revision))
    await owner.send_heartbeats(2)
    answer_released.set()
    await asyncio.gather(opening, return_exceptions=True)
    await wait_until(lambda: not owner.stages)
    await require_gone("s", server, owner, other)


@pytest.mark.parametrize("seed", range(4))
async def test_random_faults_leave_one_stage_for_each_record(
    start: Callable[[Random, float], Replica], server: MemoryKeyValueStore, seed: int
) -> None:
    """Sessions are opened, edited and ended at replicas that die, with late and lost answers."""
    random = Random(seed)
    replicas = [start(random, 0.03) for _ in range(3)]
    for replica in replicas:
        replica.store.loss = 0.15
        await replica.send_heartbeats(1)
    living, opened, ended = list(replicas), [f"s{number}" for number in range(8)], set()

    async def use(session: str) -> None:
        while True:
            try:
                await random.choice(living).sessions.open_session("one", session=session)
                break
            except BackendUnavailable:
                await asyncio.sleep(0.02)
            except RevisionConflict:
                # an attempt whose answer was lost had succeeded
                break
        for _ in range(random.randrange(4)):
            await asyncio.sleep(random.random() * 0.2)
            try:
                await random.choice(living).sessions.stage_proxy(session).edit(SessionEdit(playing=False))
            except (BackendUnavailable, ProblemError):
                continue
        # an attempt whose answer was lost may have ended it: repeat until the answer is known
        is_to_end = random.random() < 0.7
        while is_to_end:
            try:
                await random.choice(living).sessions.stage_proxy(session).end()
            except BackendUnavailable:
                continue
            except ProblemError as problem:
                if problem.status != 404:
                    await asyncio.sleep(0.02)
                    continue
            ended.add(session)
            break

    using = asyncio.gather(*map(use, opened))
    await asyncio.sleep(0.15)
    killed = living.pop()
    await killed.stop()
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await using
    for replica in living:
        replica.store.loss = 0.0
        await replica.send_heartbeats(12)
    expected = set(opened) - ended
    assert {key.partition(".")[2] for key in server.watch().entries if key.startswith("sessions.")} == expected
    assert sorted(session for replica in living for session in replica.stages) == sorted(expected)
    for session in expected:
        assert (await living[0].sessions.stage_proxy(session).describe())["id"] == session


async def test_owner_publishes_state_after_reconnection(
    context: ServiceContext, start: Callable[[], Replica], monkeypatch: pytest.MonkeyPatch
) -> None:
    reconnected: list[Callable[[], None]] = []
    monkeypatch.setattr(context.bus, "on_reconnect", reconnected.append)
    owner = start()
    session = (await owner.sessions.open_session("one"))["id"]
    published: list[bytes] = []
    context.bus.subscribe(f"session.{session}.timeline", published.append)
    monkeypatch.setattr(context.bus, "reconnects", 1)
    reconnected[0]()
    await wait_until(lambda: bool(published))
    assert published == [owner.sessions._endpoints[session].stage.timeline.pack()]


async def test_replica_that_lost_a_session_publishes_nothing_after_reconnection(
    context: ServiceContext,
    start: Callable[[], Replica],
    server: MemoryKeyValueStore,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reconnected: list[Callable[[], None]] = []
    monkeypatch.setattr(context.bus, "on_reconnect", reconnected.append)
    owner, other = start(), start()
    sessions = [(await owner.sessions.open_session("one"))["id"] for _ in range(2)]
    lost, kept = sessions
    await other.send_heartbeats(2)
    # the other replica has written the record and has no stage yet
    other.store.held_calls["put sessions"] = asyncio.Event()
    owner.store.watch_released.clear()
    stage = owner.sessions._endpoints[lost].stage
    record = SessionRecord(other.id, stage.created, stage.timeline.pack())
    await server.put(session_key(lost), record.pack())
    published: list[str] = []
    for session in sessions:

        def receive(_: bytes, session: str = session) -> None:
            published.append(session)

        context.bus.subscribe(f"session.{session}.timeline", receive)
    monkeypatch.setattr(context.bus, "reconnects", 1)
    reconnected[0]()
    owner.store.watch_released.set()
    await wait_until(lambda: bool(published))
    assert published == [kept]
    assert owner.stages == {kept}
