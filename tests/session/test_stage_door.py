from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import msgpack
import pytest

from bunraku.backing.backing import Backing, clock, open_backing
from bunraku.backing.library import StoredMotion, pack
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.codec.encode import encode_motion
from bunraku.playout import timeline
from bunraku.session import puppeteers, stage_door
from bunraku.session.distant import DistantStage
from bunraku.session.requests import SessionEdit
from bunraku.session.stage import Stage, troupe_of
from bunraku.session.stage_door import StageDoor
from bunraku.session.visitor import Visitor
from bunraku.wire.messages import Claim
from tests.vectors.blocks import wandering_motion


class Owner:
    """Notes what is asked of the keeper of stages."""

    def __init__(self) -> None:
        self.noted: list[bytes] = []
        self.ended: list[str] = []

    async def motion(self, motion: str) -> StoredMotion:
        raise ProblemError(404, "No such motion", motion)

    async def note(self, stage: Stage) -> None:
        self.noted.append(stage.timeline.pack())

    async def end(self, session: str) -> None:
        self.ended.append(session)


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[Backing]:
    async with open_backing(Settings(data=tmp_path)) as opened:
        encoded = encode_motion(wandering_motion(2.0, 30.0, 1), ladder=(30.0,), grade="live")
        await opened.library.put("one", pack("one", encoded))
        yield opened


@pytest.fixture
def owner() -> Owner:
    return Owner()


@pytest.fixture
async def door(backing: Backing, owner: Owner) -> AsyncIterator[StageDoor]:
    stored = await backing.library.get("one")
    assert stored is not None
    state = timeline.start("one", stored.track.duration_us, clock())
    stage = Stage("s", stored, troupe_of(stored), backing.bus, state, state.clock)
    opened = StageDoor(stage, backing, owner, 1)
    yield opened
    await opened.close()


async def come(backing: Backing, name: str) -> tuple[DistantStage, Visitor]:
    stage, visitor = DistantStage("s", backing.bus, backing.register), Visitor()
    backing.bus.subscribe(stage.told(visitor), visitor.tell)
    await stage.join(visitor, name)
    return stage, visitor


async def test_an_edit_is_noted_before_it_is_acknowledged(backing: Backing, door: StageDoor, owner: Owner) -> None:
    stage = DistantStage("s", backing.bus, backing.register)
    await stage.edit(SessionEdit(playing=False))
    assert owner.noted == [door.stage.timeline.pack()]
    assert not door.stage.timeline.playing
    await stage.end()
    assert owner.ended == ["s"]


@pytest.mark.usefixtures("door")
async def test_a_full_stage_says_so(backing: Backing, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteers, "MOST", 1)
    await come(backing, "a")
    with pytest.raises(ProblemError, match="1 puppeteers are here") as refused:
        await come(backing, "b")
    assert refused.value.status == 503


@pytest.mark.usefixtures("door")
async def test_one_whom_the_stage_does_not_know_is_told_so(backing: Backing) -> None:
    stage, visitor = DistantStage("s", backing.bus, backing.register), Visitor()
    backing.bus.subscribe(stage.told(visitor), visitor.tell)
    stage.say(visitor, None)
    assert not visitor.gone
    stage.say(visitor, b"")
    assert visitor.gone


async def test_those_whose_replica_died_leave_and_the_others_stay(backing: Backing, door: StageDoor) -> None:
    stage, dead = await come(backing, "dead")
    _, here = await come(backing, "here")
    stage.say(dead, Claim(0).pack())
    stage.say(here, Claim(1).pack())
    assert door.stage.presence.limbs == [dead.id, here.id, None, None]
    for puppeteer in door.stage.puppeteers:
        if puppeteer.id == dead.id:
            puppeteer.heard -= stage_door.VANISHED
    async with asyncio.timeout(20):
        while not dead.gone:
            dead.wake.clear()
            await dead.wake.wait()
    assert dead.gone
    assert not here.gone
    assert [one["name"] for one in door.stage.presence.puppeteers] == ["here"]


@pytest.mark.usefixtures("door")
async def test_answers_are_of_plain_values(backing: Backing) -> None:
    answer = msgpack.unpackb(await backing.bus.ask("session.s.describe", msgpack.packb(None)))
    assert answer["answer"]["id"] == "s"
