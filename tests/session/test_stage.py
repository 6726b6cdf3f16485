from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import msgpack
import numpy as np
import pytest

from bunraku.backing.bus import MemoryBus
from bunraku.backing.library import Library, StoredMotion, pack
from bunraku.codec import decode
from bunraku.codec.encode import encode_motion
from bunraku.marionette.merge import Marionette
from bunraku.session import stage as stages
from bunraku.session.stage import LEAD, Full, Puppeteer, Stage
from bunraku.wire.messages import Claim, Grant, Input, Overlay, Presence, Release, TimelineState, unpack
from tests.vectors.blocks import wandering_motion


class Audience:
    """What a stage says on the bus."""

    def __init__(self, bus: MemoryBus) -> None:
        self.heard: list[object] = []
        self._more = asyncio.Event()
        for subject in ("timeline", "presence", "overlay"):
            bus.subscribe(f"session.s.{subject}", self._hear)

    def _hear(self, message: bytes) -> None:
        self.heard.append(unpack(message))
        self._more.set()

    async def until(self, number: int, kind: type) -> list[object]:
        async with asyncio.timeout(10):
            while len(found := [m for m in self.heard if isinstance(m, kind)]) < number:
                self._more.clear()
                await self._more.wait()
        return found


async def stored(name: str, seed: int) -> StoredMotion:
    library = Library.open("memory:///")
    await library.put(
        name, pack(name, encode_motion(wandering_motion(2.3, 30.0, seed), ladder=(30.0, 5.0), grade="live"))
    )
    motion = await library.get(name)
    assert motion is not None
    return motion


@pytest.fixture
async def bus() -> MemoryBus:
    return MemoryBus()


@pytest.fixture
async def stage(bus: MemoryBus) -> AsyncIterator[Stage]:
    await asyncio.to_thread(decode.warm)
    motion = await stored("one", 5)
    opened = Stage("s", motion, Marionette(motion.track.figure), bus, playing=True, loop=True)
    yield opened
    await opened.close()


def granted(puppeteer: Puppeteer) -> Grant:
    return next(m for m in map(unpack, reversed(puppeteer.waiting)) if isinstance(m, Grant))


async def test_overlays_carry_only_pulled_limbs_and_end_with_an_empty_one(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    aiko = stage.join("Aiko")
    stage.hear(aiko, Claim(0))
    epoch = granted(aiko).epoch
    await audience.until(5, Overlay)
    stage.hear(aiko, Input(0, Input.TARGET, epoch, 1, 0, (0.5, 0.2, 0.4)))
    await audience.until(20, Overlay)
    stage.hear(aiko, Release(0, epoch))
    async with asyncio.timeout(10):
        while not isinstance(last := audience.heard[-1], Overlay) or last.limbs:
            await audience.until(len([m for m in audience.heard if isinstance(m, Overlay)]) + 1, Overlay)
    overlays = [m for m in audience.heard if isinstance(m, Overlay)]
    assert {tuple(o.limbs) for o in overlays} == {(0,), ()}
    assert [o.sequence for o in overlays] == list(range(overlays[0].sequence, overlays[0].sequence + len(overlays)))
    dues = np.diff([o.due for o in overlays])
    assert (dues > 0).all()
    assert overlays[-1].limbs == {}


async def test_edits_hold_for_everyone_a_lead_from_now(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    before = stage.timeline
    stage.edit(playing=False, position=None, loop=None)
    (state,) = await audience.until(1, TimelineState)
    assert isinstance(state, TimelineState)
    assert (state.epoch, state.playing) == (before.epoch + 1, False)
    assert state.clock >= before.clock + LEAD


async def test_limbs_stay_held_when_the_motion_changes(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    aiko = stage.join("Aiko")
    stage.hear(aiko, Claim(3))
    await audience.until(2, Overlay)
    await stage.change(await stored("two", 6))
    assert stage.timeline.motion == "two"
    assert stage.presence.limbs[3] == aiko.id
    count = len(await audience.until(1, Overlay))
    await audience.until(count + 3, Overlay)


async def test_colours_are_given_in_order_and_again_when_free(stage: Stage) -> None:
    people = [stage.join(f"p{n}") for n in range(6)]
    assert [p.colour for p in people] == [0, 1, 2, 3, 4, 0]
    stage.leave(people[2])
    assert stage.join("new").colour == 2


async def test_a_stage_is_full_some_day(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stages, "PUPPETEERS", 2)
    stage.join("a")
    stage.join("b")
    with pytest.raises(Full):
        stage.join("c")


@pytest.mark.usefixtures("stage")
async def test_presence_counts_viewers_of_all_replicas(bus: MemoryBus) -> None:
    audience = Audience(bus)
    for replica, count in (("a", 3), ("b", 4), ("a", 2), ("b", 0)):
        bus.publish("session.s.viewers", msgpack.packb([replica, count]))
    counts = [p.viewers for p in await audience.until(4, Presence) if isinstance(p, Presence)]
    assert counts == [3, 7, 6, 2]


async def test_one_who_does_not_listen_is_marked(stage: Stage) -> None:
    aiko = stage.join("Aiko")
    for _ in range(stages.QUEUE):
        stage.hear(aiko, Claim(0))
    assert aiko.overrun
    assert len(aiko.waiting) == stages.QUEUE
