from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

import msgpack
import numpy as np
import pytest

from bunraku.backing.backing import clock
from bunraku.backing.bus import MemoryBus
from bunraku.backing.library import Library, StoredMotion, pack
from bunraku.codec import decode
from bunraku.codec.encode import encode_motion
from bunraku.marionette.log import Log
from bunraku.marionette.ownership import LOST_AFTER
from bunraku.motion import rotation
from bunraku.playout import timeline
from bunraku.playout.blocks import BlockStore
from bunraku.playout.overlays import pack_joints
from bunraku.playout.timeline import position_at
from bunraku.session import puppeteers
from bunraku.session.puppeteers import Full, Puppeteer
from bunraku.session.stage import EDIT_LEAD, FRAME, FRAMES, Stage, troupe_of
from bunraku.wire.messages import (
    Alive,
    Ask,
    Claim,
    Data,
    Grant,
    Input,
    Notice,
    Presence,
    Refusal,
    Release,
    TimelineState,
    unpack,
)
from bunraku.wire.overlay import Overlay
from tests.ingest.dances import DANCES
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

    async def alone(self) -> None:
        """Until the dance is alone."""
        count = 1
        while (found := await self.until(count, Overlay)) and found[-1].limbs:  # type: ignore[attr-defined]
            count = len(found) + 1


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
    state = timeline.start("one", motion.track.duration_us, clock())
    opened = Stage("s", motion, troupe_of(motion), bus, state, state.clock)
    yield opened
    await opened.close()


@dataclass
class Person:
    """One who came to a stage, and what they were told."""

    at: Puppeteer
    told: list[bytes]

    @property
    def id(self) -> str:
        return self.at.id


def enter(stage: Stage, name: str) -> Person:
    told: list[bytes] = []
    return Person(stage.join(name.lower(), name, told.append), told)


def granted(person: Person) -> Grant:
    return next(m for m in map(unpack, reversed(person.told)) if isinstance(m, Grant))


@asynccontextmanager
async def holding(stage: Stage, person: Person, limb: int) -> AsyncIterator[None]:
    """Meanwhile they say that they hold it, however long that takes."""

    async def alive() -> None:
        while True:
            stage.hear(person.at, Alive([limb]))
            await asyncio.sleep(0.05)

    speaking = asyncio.create_task(alive())
    try:
        yield
    finally:
        speaking.cancel()


async def test_overlays_carry_only_pulled_limbs_and_end_with_an_empty_one(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    aiko = enter(stage, "Aiko")
    stage.hear(aiko.at, Claim(0))
    epoch = granted(aiko).epoch
    await audience.until(5, Overlay)
    stage.hear(aiko.at, Input(0, Input.TARGET, epoch, 1, 0, (0.5, 0.2, 0.4)))
    await audience.until(20, Overlay)
    stage.hear(aiko.at, Release(0, epoch))
    await audience.alone()
    overlays = [m for m in audience.heard if isinstance(m, Overlay)]
    assert {tuple(o.limbs) for o in overlays} == {(0,), ()}
    assert [o.sequence for o in overlays] == list(range(overlays[0].sequence, overlays[0].sequence + len(overlays)))
    dues = np.diff([o.due for o in overlays])
    assert (dues % FRAME == 0).all()
    assert (dues >= FRAME * FRAMES).all()
    assert {len(o.earlier) for o in overlays if o.limbs} <= set(range(FRAMES))
    assert max(len(o.earlier) for o in overlays) == FRAMES - 1
    assert overlays[-1].limbs == {}


async def test_edits_hold_for_everyone_a_lead_from_now(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    before = stage.timeline
    stage.edit(playing=False, position=None, loop=None)
    (state,) = await audience.until(1, TimelineState)
    assert isinstance(state, TimelineState)
    assert (state.epoch, state.playing) == (before.epoch + 1, False)
    assert state.clock >= before.clock + EDIT_LEAD


async def test_limbs_stay_held_when_the_motion_changes(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    aiko = enter(stage, "Aiko")
    two = await stored("two", 6)
    stage.hear(aiko.at, Claim(3))
    async with holding(stage, aiko, 3):
        await audience.until(2, Overlay)
        await stage.change(two)
        assert stage.timeline.motion == "two"
        assert stage.presence.limbs[3] == aiko.id
        count = len(await audience.until(1, Overlay))
        await audience.until(count + 3, Overlay)


async def test_colours_are_given_in_order_and_again_when_free(stage: Stage) -> None:
    people = [enter(stage, f"p{n}") for n in range(6)]
    assert [p.at.colour for p in people] == [0, 1, 2, 3, 4, 0]
    stage.leave(people[2].at)
    assert enter(stage, "new").at.colour == 2


async def test_a_stage_is_full_some_day(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteers, "MOST", 2)
    enter(stage, "a")
    enter(stage, "b")
    with pytest.raises(Full):
        enter(stage, "c")


@pytest.mark.usefixtures("stage")
async def test_presence_counts_viewers_of_all_replicas(bus: MemoryBus) -> None:
    audience = Audience(bus)
    for replica, count in (("a", 3), ("b", 4), ("a", 2), ("b", 0)):
        bus.publish("session.s.viewers", msgpack.packb([replica, count]))
    # the first at once; then those of half a second together, however many replicas there are
    counts = [p.viewers for p in await audience.until(2, Presence) if isinstance(p, Presence)]
    assert counts == [3, 2]
    bus.publish("session.s.viewers", msgpack.packb(["b", 1]))
    counts = [p.viewers for p in await audience.until(3, Presence) if isinstance(p, Presence)]
    assert counts == [3, 2, 3]


async def test_an_asked_limb_goes_to_who_asked_when_it_is_let_go(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    aiko, ben = enter(stage, "Aiko"), enter(stage, "Ben")
    stage.hear(aiko.at, Claim(1))
    stage.hear(ben.at, Claim(1))
    assert unpack(ben.told[-1]) == Refusal(1, "held", aiko.id)
    stage.hear(ben.at, Ask(1, True))
    assert stage.presence.asks == [[], [ben.id], [], []]
    stage.hear(aiko.at, Release(1, granted(aiko).epoch))
    assert granted(ben).limb == 1
    assert stage.presence.limbs[1] == ben.id
    assert stage.presence.asks == [[]] * 4
    presences = [m for m in audience.heard if isinstance(m, Presence)]
    assert [ben.id] in [p.asks[1] for p in presences]
    stage.leave(ben.at)
    assert stage.presence.limbs[1] is None


@pytest.mark.parametrize("said", [Alive([0]), Input(0, Input.TARGET, 1, 5, 0, (0.1, 0.0, 0.0))])
async def test_who_missed_that_a_limb_was_lost_is_told_again(stage: Stage, said: Alive | Input) -> None:
    aiko = enter(stage, "Aiko")
    ben = enter(stage, "Ben")
    stage.hear(aiko.at, Claim(0))
    # it is taken from her while nothing can be said
    stage._troupe.release(0, aiko.id, granted(aiko).epoch, clock())
    for _ in range(5):
        stage.hear(aiko.at, said)
        stage.hear(ben.at, said)
    assert not [m for m in map(unpack, ben.told) if isinstance(m, Refusal)]
    assert [m for m in map(unpack, aiko.told) if isinstance(m, Refusal)] == [Refusal(0, "lost")]
    stage.hear(aiko.at, Claim(0))
    told = len(aiko.told)
    stage.hear(aiko.at, Alive([0]))
    assert not [m for m in map(unpack, aiko.told[told:]) if isinstance(m, Refusal)]


async def test_inputs_that_are_not_taken_as_they_come_are_told_of_once_a_second(stage: Stage) -> None:
    aiko, ben = enter(stage, "Aiko"), enter(stage, "Ben")
    stage.hear(aiko.at, Claim(0))
    epoch = granted(aiko).epoch
    for number in range(5):
        stage.hear(aiko.at, Input(0, Input.TARGET, epoch, number, 0, (900.0, 0.0, 0.0)))
        stage.hear(ben.at, Input(0, Input.TARGET, epoch, number, 0, (0.1, 0.0, 0.0)))
    told = [m for m in map(unpack, aiko.told) if isinstance(m, Notice)]
    assert [(m.limb, m.reason) for m in told] == [(0, "reach")]
    told = [m for m in map(unpack, ben.told) if isinstance(m, Notice)]
    assert [(m.limb, m.reason) for m in told] == [(0, "owner")]
    assert "left hand" in told[0].detail


async def test_the_limbs_of_all_performers_are_pulled_and_one_message_tells_of_them(bus: MemoryBus) -> None:
    motion, audience = DANCES["both"], Audience(bus)
    state = timeline.start("both", motion.track.duration_us, clock())
    stage = Stage("s", motion, troupe_of(motion), bus, state, state.clock)
    aiko, ben = enter(stage, "Aiko"), enter(stage, "Ben")
    stage.hear(aiko.at, Claim(1))
    stage.hear(ben.at, Claim(6))
    assert granted(ben).limb == 6
    assert stage.presence.limbs == [None, aiko.id, None, None, None, None, ben.id, None]
    assert len(stage.presence.asks) == 8
    stage.hear(ben.at, Claim(9))
    assert unpack(ben.told[-1]) == Refusal(9, "unknown")
    for number in range(8):
        stage.hear(aiko.at, Input(1, Input.TARGET, 1, number, 16_000 * number, (-0.6, 0.3, 0.3)))
        stage.hear(ben.at, Input(6, Input.VELOCITY, 1, number, 16_000 * number, (0.5, 0.0, 0.0)))
        await audience.until(len([m for m in audience.heard if isinstance(m, Overlay)]) + 1, Overlay)
    told = [m for m in audience.heard if isinstance(m, Overlay)]
    assert {tuple(overlay.limbs) for overlay in told} == {(1, 6)}
    # an input for a limb that is nobody's here is not taken, and said so by the limb's name
    stage.hear(ben.at, Input(12, Input.VELOCITY, 1, 1, 0, (0.5, 0.0, 0.0)))
    assert [m.detail for m in map(unpack, ben.told) if isinstance(m, Notice)] == [
        "the left hand of dancer 4 is not yours: an input for it was refused"
    ]
    # the second performer goes, and Ben's leg with them; Aiko's hand stays in hers
    async with holding(stage, aiko, 1):
        await stage.change(await stored("two", 6))
    assert stage.presence.limbs == [None, aiko.id, None, None]
    assert Refusal(6, "lost") in map(unpack, ben.told)
    await audience.until(1, TimelineState)
    stage.hear(aiko.at, Release(1, 1))
    await audience.alone()
    await stage.close()


async def test_the_log_replays_to_what_was_shown(stage: Stage, bus: MemoryBus) -> None:
    """Two people pull, let go, and pull again; every frame that was published comes again from the log's bytes."""
    audience = Audience(bus)
    aiko, ben = enter(stage, "Aiko"), enter(stage, "Ben")
    for passage in range(2):
        stage.hear(aiko.at, Claim(0))
        stage.hear(ben.at, Claim(3))
        hand, leg = granted(aiko).epoch, granted(ben).epoch
        for number in range(12):
            stage.hear(aiko.at, Input(0, Input.TARGET, hand, number, 16_000 * number, (0.4, 0.05 * number - 0.2, 0.3)))
            stage.hear(ben.at, Input(3, Input.VELOCITY, leg, number, 16_000 * number, (0.5, 0.0, 0.0)))
            count = len([m for m in audience.heard if isinstance(m, Overlay)])
            await audience.until(count + 1, Overlay)
        stage.hear(aiko.at, Release(0, hand))
        stage.hear(ben.at, Release(3, leg))
        await audience.alone()
        assert passage == 0 or stage.log.begin is not None
    shown: dict[int, dict[int, tuple[int, ...]]] = {}
    for overlay in audience.heard:
        if isinstance(overlay, Overlay):
            frames = (*overlay.earlier, overlay.limbs)
            shown |= {overlay.due - FRAME * (len(frames) - 1 - nth): limbs for nth, limbs in enumerate(frames)}
    motion = await stored("one", 5)
    blocks = BlockStore(motion.track)
    for index, packet in enumerate(motion.dance[-1]):
        blocks.put(index, 0, decode.decode_block(motion.track, Data.unpack(packet).block))
    state = stage.timeline

    def poses_at(due: int) -> list[rotation.Array]:
        pose = blocks.pose_at(position_at(state, due), state.loop)
        assert pose is not None
        return [pose[1]]

    again = {
        due: {limb: pack_joints(joints) for limb, joints in laid.items()}
        for due, laid in Log.unpack(stage.log.pack()).replay(lambda _: [motion.track.figure], poses_at)
    }
    # once the dance is alone nothing is noted
    assert {due: again.get(due) or {} for due in shown} == shown


async def test_a_holder_whom_a_stalled_server_could_not_hear_keeps_the_limb(stage: Stage, bus: MemoryBus) -> None:
    audience = Audience(bus)
    aiko = enter(stage, "Aiko")
    stage.hear(aiko.at, Claim(0))
    async with holding(stage, aiko, 0):
        shown = len(await audience.until(2, Overlay))
    # the machine has something else to do for longer than a lease: what Aiko says meanwhile waits at the socket
    time.sleep(1.5e-6 * LOST_AFTER)  # noqa: ASYNC251 - it is the loop that stands still
    await audience.until(shown + 1, Overlay)
    async with holding(stage, aiko, 0):
        await audience.until(shown + 8, Overlay)
    assert stage.presence.limbs[0] == aiko.id


async def test_one_that_goes_on_here_tells_where_it_is_and_that_nobody_holds_a_limb(
    stage: Stage, bus: MemoryBus
) -> None:
    audience = Audience(bus)
    stage.appear()
    state, presence, overlay = audience.heard
    assert state == stage.timeline
    assert isinstance(presence, Presence)
    assert presence.limbs == [None] * 4
    assert isinstance(overlay, Overlay)
    assert overlay.limbs == {}
    assert overlay.due > clock()
