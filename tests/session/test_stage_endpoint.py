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
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session import puppeteer_roster, stage_endpoint
from bunraku.session.puppeteer_connection import PuppeteerConnection
from bunraku.session.schema import SessionEdit
from bunraku.session.stage import SessionStart, Stage
from bunraku.session.stage_endpoint import StageEndpoint
from bunraku.session.stage_proxy import StageProxy
from bunraku.wire.messages import Claim
from tests.vectors.blocks import random_motion


class FakeStageOwner:
    """Notes what is asked of the keeper of stages."""

    def __init__(self) -> None:
        self.saved: list[bytes] = []
        self.ended: list[str] = []

    async def load_motion(self, motion: str) -> StoredMotion:
        raise ProblemError(404, "No such motion", motion)

    async def save_record(self, stage: Stage) -> None:
        self.saved.append(stage.timeline.pack())

    async def end_session(self, session: str) -> None:
        self.ended.append(session)


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path)) as opened:
        encoded = encode_motion(random_motion(2.0, 30.0, 1), error_bounds_mm=(30.0,), grade="live")
        await opened.motion_store.put("one", pack_motion("one", encoded))
        yield opened


@pytest.fixture
def owner() -> FakeStageOwner:
    return FakeStageOwner()


@pytest.fixture
async def door(backing: ServiceContext, owner: FakeStageOwner) -> AsyncIterator[StageEndpoint]:
    stored = await backing.motion_store.get("one")
    assert stored is not None
    state = timeline.start("one", stored.first_track.duration_us, backing.clock())
    stage = Stage(SessionStart("s", stored, state, state.clock), backing.bus, backing.clock)
    opened = StageEndpoint(stage, backing, owner, 1)
    yield opened
    await opened.close()


async def join_stage(context: ServiceContext, name: str) -> tuple[StageProxy, PuppeteerConnection]:
    stage, visitor = StageProxy("s", context.bus, context.key_values), PuppeteerConnection()
    context.bus.subscribe(stage.outgoing_subject(visitor), visitor.send)
    await stage.join(visitor, name)
    return stage, visitor


async def test_an_edit_is_noted_before_it_is_acknowledged(
    backing: ServiceContext, door: StageEndpoint, owner: FakeStageOwner
) -> None:
    stage = StageProxy("s", backing.bus, backing.key_values)
    await stage.edit(SessionEdit(playing=False))
    assert owner.saved == [door.stage.timeline.pack()]
    assert not door.stage.timeline.playing
    await stage.end()
    assert owner.ended == ["s"]


@pytest.mark.usefixtures("door")
async def test_join_of_a_full_stage_gives_503(backing: ServiceContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS", 1)
    await join_stage(backing, "a")
    with pytest.raises(ProblemError, match="1 puppeteers are here") as refused:
        await join_stage(backing, "b")
    assert refused.value.status == 503


@pytest.mark.usefixtures("door")
async def test_unknown_puppeteer_is_notified(backing: ServiceContext) -> None:
    stage, visitor = StageProxy("s", backing.bus, backing.key_values), PuppeteerConnection()
    backing.bus.subscribe(stage.outgoing_subject(visitor), visitor.send)
    stage.send(visitor, None)
    assert not visitor.is_unknown
    stage.send(visitor, b"")
    assert visitor.is_unknown


async def test_puppeteer_of_a_dead_replica_is_removed(backing: ServiceContext, door: StageEndpoint) -> None:
    stage, dead = await join_stage(backing, "dead")
    _, here = await join_stage(backing, "here")
    stage.send(dead, Claim(0).pack())
    stage.send(here, Claim(1).pack())
    assert door.stage.presence.limbs == [dead.id, here.id, None, None]
    for puppeteer in door.stage.puppeteers:
        if puppeteer.id == dead.id:
            puppeteer.last_heard_us -= stage_endpoint.PUPPETEER_TIMEOUT_US
    async with asyncio.timeout(20):
        while not dead.is_unknown:
            dead.has_messages.clear()
            await dead.has_messages.wait()
    assert dead.is_unknown
    assert not here.is_unknown
    assert [one["name"] for one in door.stage.presence.puppeteers] == ["here"]


@pytest.mark.usefixtures("door")
async def test_answers_are_of_plain_values(backing: ServiceContext) -> None:
    answer = msgpack.unpackb(await backing.bus.request("session.s.describe", msgpack.packb(None)))
    assert answer["answer"]["id"] == "s"
