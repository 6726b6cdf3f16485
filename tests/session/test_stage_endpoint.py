from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import msgpack
import pytest

from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.playout import timeline
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.input_scheduler import TURN_US, InputScheduler
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session import puppeteer_roster, stage_endpoint
from bunraku.session.live.cast import Cast
from bunraku.session.live.cast_store import CastStore
from bunraku.session.schema import SessionEdit
from bunraku.session.session_start import Fittings, SessionStart
from bunraku.session.stage import Stage
from bunraku.session.stage_endpoint import StageEndpoint
from bunraku.session.stage_proxy import StageProxy
from bunraku.stream.watched_session import VIEWER_COUNT_REFRESH_S
from bunraku.wire.messages import Claim, Grant, Put, TimelineState, unpack
from bunraku.wire.prop import PropKind
from tests.session.recording_puppeteer import RecordingPuppeteer
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion


class FakeStageOwner:
    """Owner that records its calls."""

    def __init__(self) -> None:
        self.saved: list[bytes] = []
        self.shown: list[bytes] = []
        """Timeline of the stage at each time it was saved."""
        self.fails = False
        self.input_scheduler = InputScheduler(TURN_US)
        self.ended: list[str] = []
        self._has_saved = asyncio.Event()
        self.casts: CastStore

    async def wait_for_saves(self, count: int) -> None:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while len(self.saved) < count:
                self._has_saved.clear()
                await self._has_saved.wait()

    def require_room(self, subject: str) -> None:
        assert subject is not None

    async def load_cast(self, cast: Cast) -> StoredMotion:
        raise ProblemError(404, "No such motion", cast.motion)

    async def save_record(
        self,
        stage: Stage,
        state: TimelineState,
        cast: Cast,  # noqa: ARG002
        fittings: Fittings | None = None,  # noqa: ARG002
    ) -> None:
        self.saved.append(state.pack())
        self.shown.append(stage.timeline.pack())
        self._has_saved.set()
        if self.fails:
            raise ProblemError(503, "Session elsewhere", "another server has taken over this session")

    async def end_session(self, session: str) -> None:
        self.ended.append(session)


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path)) as opened:
        encoded = encode_motion(random_motion(2.0, 30.0, 1), error_bounds_mm=(30.0,), grade="live")
        await opened.motion_store.put("one", pack_motion("one", encoded))
        yield opened


@pytest.fixture
def owner() -> FakeStageOwner:
    return FakeStageOwner()


async def open_endpoint(context: ServiceContext, owner: FakeStageOwner) -> StageEndpoint:
    stored = await context.motion_store.get("one")
    assert stored is not None
    state = timeline.start("one", stored.first_track.duration_us, context.clock())
    stage = Stage(SessionStart("s", stored, state, state.clock), context.bus, context.clock)
    owner.casts = CastStore(context.motion_store)
    return StageEndpoint(stage, context, owner, 1)


@pytest.fixture
async def endpoint(context: ServiceContext, owner: FakeStageOwner) -> AsyncIterator[StageEndpoint]:
    opened = await open_endpoint(context, owner)
    yield opened
    await opened.close()


async def join_stage(
    context: ServiceContext, name: str, subject: str | None = None
) -> tuple[StageProxy, RecordingPuppeteer]:
    stage, connection = StageProxy("s", context.bus, context.key_values, subject), RecordingPuppeteer()
    context.bus.subscribe(stage.outgoing_subject(connection), connection.send)
    await stage.join(connection, name)
    return stage, connection


async def wait_for_grant(puppeteer: RecordingPuppeteer) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not any(isinstance(unpack(message), Grant) for message in puppeteer.queued):
            puppeteer.has_messages.clear()
            await puppeteer.has_messages.wait()


async def test_edit_that_cannot_be_saved_is_not_shown(
    context: ServiceContext, endpoint: StageEndpoint, owner: FakeStageOwner
) -> None:
    owner.fails, before = True, endpoint.stage.timeline
    published: list[bytes] = []
    context.bus.subscribe("session.s.timeline", published.append)
    with pytest.raises(ProblemError, match="taken over"):
        await StageProxy("s", context.bus, context.key_values).edit(SessionEdit(playing=False))
    assert endpoint.stage.timeline is before
    assert published == []


async def test_edit_is_saved_before_it_is_shown_and_acknowledged(
    context: ServiceContext, endpoint: StageEndpoint, owner: FakeStageOwner
) -> None:
    stage = StageProxy("s", context.bus, context.key_values)
    before = endpoint.stage.timeline.pack()
    await stage.edit(SessionEdit(playing=False))
    assert owner.saved == [endpoint.stage.timeline.pack()]
    assert owner.shown == [before]
    assert not endpoint.stage.timeline.playing
    await stage.end()
    assert owner.ended == ["s"]


@pytest.mark.usefixtures("endpoint")
async def test_join_of_a_full_stage_gives_503(context: ServiceContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS", 1)
    await join_stage(context, "a")
    with pytest.raises(ProblemError, match="1 puppeteers are here") as refused:
        await join_stage(context, "b")
    assert refused.value.status == 503


@pytest.mark.usefixtures("endpoint")
async def test_unknown_puppeteer_is_notified(context: ServiceContext) -> None:
    stage, connection = StageProxy("s", context.bus, context.key_values), RecordingPuppeteer()
    context.bus.subscribe(stage.outgoing_subject(connection), connection.send)
    stage.send(connection, None)
    assert not connection.is_unknown
    stage.send(connection, b"")
    assert connection.is_unknown


async def test_puppeteer_of_a_dead_replica_is_removed(context: ServiceContext, endpoint: StageEndpoint) -> None:
    stage, dead = await join_stage(context, "dead")
    _, living = await join_stage(context, "living")
    for limb, joined in enumerate((dead, living)):
        stage.send(joined, Claim(limb).pack())
        # on a slow machine its turn is in a later iteration of the event loop
        await wait_for_grant(joined)
    assert endpoint.stage.presence.limbs == [dead.id, living.id, None, None]
    for puppeteer in endpoint.stage.puppeteers:
        if puppeteer.id == dead.id:
            puppeteer.last_heard_us -= stage_endpoint.PUPPETEER_TIMEOUT_US

    async def send_heartbeats() -> None:
        while True:
            stage.send(living, b"")
            await asyncio.sleep(0.1)

    heartbeats = asyncio.create_task(send_heartbeats())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not dead.is_unknown:
            dead.has_messages.clear()
            await dead.has_messages.wait()
    heartbeats.cancel()
    assert dead.is_unknown
    assert not living.is_unknown
    assert [one["name"] for one in endpoint.stage.presence.puppeteers] == ["living"]


@pytest.mark.usefixtures("endpoint")
async def test_answers_are_plain_values(context: ServiceContext) -> None:
    answer = msgpack.unpackb(await context.bus.request("session.s.describe", msgpack.packb(None)))
    assert answer["answer"]["id"] == "s"


async def test_viewers_of_a_dead_stream_replica_no_longer_count(
    context: ServiceContext, endpoint: StageEndpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage_endpoint, "PUPPETEER_HEARTBEAT_S", 0.02)
    monkeypatch.setattr(stage_endpoint, "VIEWER_COUNT_TIMEOUT_US", 200_000)
    stage, dead = StageProxy("s", context.bus, context.key_values), msgpack.packb(["dead", 3])
    context.bus.publish("session.s.viewers", dead)
    assert (await stage.describe())["viewers"] == 3
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while (await stage.describe())["viewers"] != 2:
            context.bus.publish("session.s.viewers", msgpack.packb(["living", 2]))
            await asyncio.sleep(0.01)
        while (await stage.describe())["viewers"] != 0:  # noqa: ASYNC110
            await asyncio.sleep(0.01)
    # nobody is left, so that the session can be ended as idle
    assert endpoint.stage.is_idle(context.clock() + 1_000_000, 1_000_000)


def test_viewer_counts_are_reported_more_often_than_they_expire() -> None:
    assert stage_endpoint.VIEWER_COUNT_TIMEOUT_US > 3e6 * VIEWER_COUNT_REFRESH_S


async def test_joins_of_one_subject_are_limited(
    context: ServiceContext, endpoint: StageEndpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the clock stands still: a slow machine gets no tokens back between the joins
    now = context.clock()
    monkeypatch.setattr(endpoint, "_clock", lambda: now)
    for _ in range(stage_endpoint.JOIN_BURST):
        stage, connection = await join_stage(context, "flooder", "one link")
        stage.send(connection, None)
        # the message has its turn
        await asyncio.sleep(0)
    with pytest.raises(ProblemError, match="too often") as refused:
        await join_stage(context, "flooder", "one link")
    assert refused.value.status == 429
    await join_stage(context, "other", "another link")
    # a server without access control has no subjects
    for _ in range(2 * stage_endpoint.JOIN_BURST):
        stage, connection = await join_stage(context, "someone")
        stage.send(connection, None)
        await asyncio.sleep(0)


async def test_join_of_a_replica_of_an_earlier_release(context: ServiceContext, endpoint: StageEndpoint) -> None:
    answer = await context.bus.request("session.s.join", msgpack.packb(["p1", "Aiko"]))
    assert msgpack.unpackb(answer) == {"answer": {"colour": 0}}
    assert [puppeteer.id for puppeteer in endpoint.stage.puppeteers] == ["p1"]


async def test_moved_props_are_saved_for_a_server_that_takes_over(
    context: ServiceContext, endpoint: StageEndpoint, owner: FakeStageOwner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage_endpoint, "PUPPETEER_HEARTBEAT_S", 0.01)
    stage, connection = await join_stage(context, "Ada")
    answer = await stage.edit(SessionEdit(props={"2": PropKind.FAN}))
    assert [(entry["prop"], entry["kind"], entry["limb"]) for entry in answer["props"]] == [(2, "fan", None)]
    owner.fails = True
    stage.send(connection, Put(2, limb=1).pack())
    await owner.wait_for_saves(4)
    assert endpoint.stage.props.has_unsaved_moves
    assert (await stage.describe())["props"][0]["limb"] == 1


async def test_session_that_is_lost_while_moves_are_saved_is_closed(
    context: ServiceContext, owner: FakeStageOwner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage_endpoint, "PUPPETEER_HEARTBEAT_S", 0.01)
    endpoint = await open_endpoint(context, owner)
    stage, connection = await join_stage(context, "Ada")
    await stage.edit(SessionEdit(props={"2": PropKind.FAN}))
    closed = asyncio.Event()

    async def lose(*_: object) -> None:
        await endpoint.close()
        closed.set()
        raise ProblemError(503, "Session elsewhere", "another server has taken over this session")

    monkeypatch.setattr(owner, "save_record", lose)
    sweep, ticks = endpoint._sweep_task, endpoint.stage._tick_task
    stage.send(connection, Put(2, limb=1).pack())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await closed.wait()
        await asyncio.wait((sweep,))
    assert ticks.done()
    assert connection.is_unknown
