from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable

import msgpack
import numpy as np
import pytest

from bunraku.codec import motion_decoder
from bunraku.codec.container import StoredMotion
from bunraku.marionette.ownership import INPUT_TIMEOUT_US
from bunraku.messaging.bus import MemoryBus
from bunraku.playout import timeline
from bunraku.playout.session_log import SessionLog
from bunraku.runtime.clock import clock
from bunraku.session import puppeteer_roster
from bunraku.session.live.cast import EMPTY_CAST, Cast
from bunraku.session.presence import PRESENCE_BURST
from bunraku.session.puppeteer_roster import Puppeteer, SessionFull
from bunraku.session.schema import SessionEdit
from bunraku.session.session_start import SessionStart
from bunraku.session.stage import (
    EDIT_LEAD_US,
    FRAME_INTERVAL_US,
    FRAMES_PER_MESSAGE,
    Stage,
    load_bend_tables,
)
from bunraku.wire.messages import (
    Alive,
    Ask,
    Bond,
    BondEnd,
    Claim,
    Input,
    Notice,
    Presence,
    Refusal,
    Release,
    TimelineState,
    unpack,
)
from bunraku.wire.overlay import Overlay
from tests.ingest.jobs.motions import MOTIONS
from tests.session.joined_stage import StageMessages, join_stage, keep_holding, last_grant, stored_motion
from tests.time_limit import HANG_TIMEOUT_S
from tests.virtual_time import run_in_virtual_time


@pytest.fixture
async def bus() -> MemoryBus:
    return MemoryBus()


async def open_stage(bus: MemoryBus, clock: Callable[[], int]) -> Stage:
    await asyncio.to_thread(motion_decoder.warm_up)
    motion = stored_motion("one", 5)
    state = timeline.start("one", motion.first_track.duration_us, clock())
    return Stage(SessionStart("s", motion, state, state.clock), bus, clock)


@pytest.fixture
async def stage(bus: MemoryBus) -> AsyncIterator[Stage]:
    opened = await open_stage(bus, clock)
    yield opened
    await opened.close()


def test_overlays_have_only_controlled_limbs_and_end_with_an_empty_one() -> None:
    overlays: list[Overlay] = []

    async def control_a_hand(clock: Callable[[], int]) -> None:
        bus = MemoryBus()
        stage, audience = await open_stage(bus, clock), StageMessages(bus)
        aiko = join_stage(stage, "Aiko")
        stage.receive(aiko.puppeteer, Claim(0))
        epoch = last_grant(aiko).epoch
        await audience.wait_for(5, Overlay)
        stage.receive(aiko.puppeteer, Input(0, Input.TARGET, epoch, 1, 0, (0.5, 0.2, 0.4)))
        await audience.wait_for(20, Overlay)
        stage.receive(aiko.puppeteer, Release(0, epoch))
        await audience.wait_until_at_rest()
        overlays.extend(m for m in audience.messages if isinstance(m, Overlay))
        await stage.close()

    # a stage that is late sends fewer frames
    run_in_virtual_time(control_a_hand)
    assert {tuple(o.limbs) for o in overlays} == {(0,), ()}
    assert [o.sequence for o in overlays] == list(range(overlays[0].sequence, overlays[0].sequence + len(overlays)))
    dues = np.diff([o.due for o in overlays])
    assert (dues % FRAME_INTERVAL_US == 0).all()
    assert (dues >= FRAME_INTERVAL_US * FRAMES_PER_MESSAGE).all()
    assert {len(o.earlier) for o in overlays if o.limbs} <= set(range(FRAMES_PER_MESSAGE))
    assert max(len(o.earlier) for o in overlays) == FRAMES_PER_MESSAGE - 1
    assert overlays[-1].limbs == {}


async def change_motion(stage: Stage, motion: StoredMotion) -> None:
    """Change the motion as the stage's endpoint does."""
    await asyncio.to_thread(load_bend_tables, motion)
    state = stage.plan_edit(SessionEdit(motion=motion.id), motion)
    assert state is not None
    stage.apply_edit(state, motion, Cast(motion.id))


async def test_edit_applies_after_the_lead_time(stage: Stage, bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    before = stage.timeline
    planned = stage.plan_edit(SessionEdit(playing=False), None)
    assert planned is not None
    assert stage.timeline is before
    stage.apply_edit(planned, None, EMPTY_CAST)
    (state,) = await audience.wait_for(1, TimelineState)
    assert isinstance(state, TimelineState)
    assert (state.epoch, state.playing) == (before.epoch + 1, False)
    assert state.clock >= before.clock + EDIT_LEAD_US


async def test_limbs_stay_held_when_the_motion_changes(stage: Stage, bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    aiko = join_stage(stage, "Aiko")
    two = stored_motion("two", 6)
    stage.receive(aiko.puppeteer, Claim(3))
    async with keep_holding(stage, aiko, 3):
        await audience.wait_for(2, Overlay)
        await change_motion(stage, two)
        assert stage.timeline.motion == "two"
        assert stage.presence.limbs[3] == aiko.id
        count = len(await audience.wait_for(1, Overlay))
        await audience.wait_for(count + 3, Overlay)


async def test_colours_are_assigned_in_order_and_reused(stage: Stage) -> None:
    puppeteers = [join_stage(stage, f"p{n}") for n in range(6)]
    assert [p.puppeteer.colour for p in puppeteers] == [0, 1, 2, 3, 4, 0]
    stage.leave(puppeteers[2].puppeteer)
    assert join_stage(stage, "new").puppeteer.colour == 2


async def test_join_beyond_the_maximum_raises_session_full(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS", 2)
    join_stage(stage, "a")
    join_stage(stage, "b")
    with pytest.raises(SessionFull):
        join_stage(stage, "c")


@pytest.mark.usefixtures("stage")
async def test_presence_counts_viewers_of_all_replicas(bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    for replica, count in (("a", 3), ("b", 4), ("a", 2), ("b", 0)):
        bus.publish("session.s.viewers", msgpack.packb([replica, count]))
    # the first count is published at once, later ones together after half a second
    counts = [p.viewers for p in await audience.wait_for(2, Presence) if isinstance(p, Presence)]
    assert counts == [3, 2]
    bus.publish("session.s.viewers", msgpack.packb(["b", 1]))
    counts = [p.viewers for p in await audience.wait_for(3, Presence) if isinstance(p, Presence)]
    assert counts == [3, 2, 3]


async def test_released_limb_is_granted_to_the_first_who_asked(stage: Stage, bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    aiko, ben = join_stage(stage, "Aiko"), join_stage(stage, "Ben")
    stage.receive(aiko.puppeteer, Claim(1))
    stage.receive(ben.puppeteer, Claim(1))
    assert unpack(ben.received[-1]) == Refusal(1, "held", aiko.id)
    stage.receive(ben.puppeteer, Ask(1, True))
    assert stage.presence.asks == [[], [ben.id], [], []]
    stage.receive(aiko.puppeteer, Release(1, last_grant(aiko).epoch))
    assert last_grant(ben).limb == 1
    assert stage.presence.limbs[1] == ben.id
    assert stage.presence.asks == [[]] * 4
    presences = [m for m in audience.messages if isinstance(m, Presence)]
    assert [ben.id] in [p.asks[1] for p in presences]
    stage.leave(ben.puppeteer)
    assert stage.presence.limbs[1] is None


async def test_subject_has_one_place_among_those_who_ask_for_a_limb(stage: Stage) -> None:
    aiko = join_stage(stage, "Aiko")
    stage.receive(aiko.puppeteer, Claim(1))
    names: list[Puppeteer] = [stage.join(f"name {n}", "Someone", lambda _: None, "one link") for n in range(5)]
    ben = stage.join("ben", "Ben", lambda _: None, "another link")
    for puppeteer in (*names, ben, *names):
        stage.receive(puppeteer, Ask(1, True))
    assert stage.presence.asks[1] == [names[0].id, ben.id]
    # the place is free again when its holder no longer asks
    stage.receive(names[0], Ask(1, False))
    stage.receive(names[1], Ask(1, True))
    stage.receive(names[1], Ask(99, True))
    assert stage.presence.asks[1] == [ben.id, names[1].id]


def test_flood_of_changes_is_published_at_a_limited_rate() -> None:
    async def flood(clock: Callable[[], int]) -> None:
        bus = MemoryBus()
        stage, audience = await open_stage(bus, clock), StageMessages(bus)
        aiko = join_stage(stage, "Aiko")
        for _ in range(500):
            stage.receive(aiko.puppeteer, Claim(1))
            stage.receive(aiko.puppeteer, Release(1, last_grant(aiko).epoch))
        stage.receive(aiko.puppeteer, Claim(2))
        presences = [m for m in audience.messages if isinstance(m, Presence)]
        assert len(presences) < 2 * PRESENCE_BURST
        # the last change is published too
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while presences[-1].limbs != stage.presence.limbs:
                presences = [m for m in audience.messages if isinstance(m, Presence)]
                await asyncio.sleep(0.01)
        await stage.close()

    # no time passes while the changes are made
    run_in_virtual_time(flood)


@pytest.mark.parametrize("message", [Alive([0]), Input(0, Input.TARGET, 1, 5, 0, (0.1, 0.0, 0.0))])
async def test_refusal_is_repeated_to_a_puppeteer_of_a_lost_limb(stage: Stage, message: Alive | Input) -> None:
    aiko = join_stage(stage, "Aiko")
    ben = join_stage(stage, "Ben")
    stage.receive(aiko.puppeteer, Claim(0))
    # she loses the limb without a message
    stage._ownership.release(0, aiko.id, last_grant(aiko).epoch, clock())
    for _ in range(5):
        stage.receive(aiko.puppeteer, message)
        stage.receive(ben.puppeteer, message)
    assert not [m for m in map(unpack, ben.received) if isinstance(m, Refusal)]
    assert [m for m in map(unpack, aiko.received) if isinstance(m, Refusal)] == [Refusal(0, "lost")]
    stage.receive(aiko.puppeteer, Claim(0))
    count = len(aiko.received)
    stage.receive(aiko.puppeteer, Alive([0]))
    assert not [m for m in map(unpack, aiko.received[count:]) if isinstance(m, Refusal)]


async def test_release_of_an_earlier_grant_keeps_the_newer_one(stage: Stage) -> None:
    aiko = join_stage(stage, "Aiko")
    stage.receive(aiko.puppeteer, Claim(0))
    earlier = last_grant(aiko).epoch
    stage.receive(aiko.puppeteer, Claim(0))
    # sent before the second grant arrived
    stage.receive(aiko.puppeteer, Release(0, earlier))
    assert stage.holders[0] == aiko.id
    # she loses the limb without a message
    stage._ownership.release(0, aiko.id, last_grant(aiko).epoch, clock())
    stage.receive(aiko.puppeteer, Alive([0]))
    assert [m for m in map(unpack, aiko.received) if isinstance(m, Refusal)] == [Refusal(0, "lost")]


async def test_notices_are_sent_once_a_second(stage: Stage) -> None:
    aiko, ben = join_stage(stage, "Aiko"), join_stage(stage, "Ben")
    stage.receive(aiko.puppeteer, Claim(0))
    epoch = last_grant(aiko).epoch
    for number in range(5):
        stage.receive(aiko.puppeteer, Input(0, Input.TARGET, epoch, number, 0, (900.0, 0.0, 0.0)))
        stage.receive(ben.puppeteer, Input(0, Input.TARGET, epoch, number, 0, (0.1, 0.0, 0.0)))
    notices = [m for m in map(unpack, aiko.received) if isinstance(m, Notice)]
    assert [(m.limb, m.reason) for m in notices] == [(0, "reach")]
    notices = [m for m in map(unpack, ben.received) if isinstance(m, Notice)]
    assert [(m.limb, m.reason) for m in notices] == [(0, "owner")]
    assert "left hand" in notices[0].detail


async def test_one_overlay_has_the_limbs_of_all_performers(bus: MemoryBus) -> None:
    motion, audience = MOTIONS["both"], StageMessages(bus)
    state = timeline.start("both", motion.first_track.duration_us, clock())
    stage = Stage(SessionStart("s", motion, state, state.clock), bus, clock)
    aiko, ben = join_stage(stage, "Aiko"), join_stage(stage, "Ben")
    stage.receive(aiko.puppeteer, Claim(1))
    stage.receive(ben.puppeteer, Claim(6))
    assert last_grant(ben).limb == 6
    assert stage.presence.limbs == [None, aiko.id, None, None, None, None, ben.id, None]
    assert len(stage.presence.asks) == 8
    stage.receive(ben.puppeteer, Claim(9))
    assert unpack(ben.received[-1]) == Refusal(9, "unknown")
    for number in range(8):
        stage.receive(aiko.puppeteer, Input(1, Input.TARGET, 1, number, 16_000 * number, (-0.6, 0.3, 0.3)))
        stage.receive(ben.puppeteer, Input(6, Input.VELOCITY, 1, number, 16_000 * number, (0.5, 0.0, 0.0)))
        await audience.wait_for(len([m for m in audience.messages if isinstance(m, Overlay)]) + 1, Overlay)
    overlays = [m for m in audience.messages if isinstance(m, Overlay)]
    assert {tuple(overlay.limbs) for overlay in overlays} == {(1, 6)}
    # the notice about an input for an unknown limb contains the name of the limb
    stage.receive(ben.puppeteer, Input(12, Input.VELOCITY, 1, 1, 0, (0.5, 0.0, 0.0)))
    assert [m.detail for m in map(unpack, ben.received) if isinstance(m, Notice)] == [
        "the left hand of dancer 4 is not yours: an input for it was refused"
    ]
    # Ben loses the leg of the removed second performer; Aiko keeps her hand
    async with keep_holding(stage, aiko, 1):
        await change_motion(stage, stored_motion("two", 6))
    assert stage.presence.limbs == [None, aiko.id, None, None]
    assert Refusal(6, "lost") in map(unpack, ben.received)
    await audience.wait_for(1, TimelineState)
    stage.receive(aiko.puppeteer, Release(1, 1))
    await audience.wait_until_at_rest()
    await stage.close()


async def test_log_holds_the_published_overlays_and_timelines(stage: Stage, bus: MemoryBus) -> None:
    """Two puppeteers claim, control and release limbs twice; the packed log gives every published message."""
    audience = StageMessages(bus)
    aiko, ben = join_stage(stage, "Aiko"), join_stage(stage, "Ben")
    for _ in range(2):
        stage.receive(aiko.puppeteer, Claim(0))
        stage.receive(ben.puppeteer, Claim(3))
        hand, leg = last_grant(aiko).epoch, last_grant(ben).epoch
        for number in range(12):
            stage.receive(
                aiko.puppeteer, Input(0, Input.TARGET, hand, number, 16_000 * number, (0.4, 0.05 * number - 0.2, 0.3))
            )
            stage.receive(ben.puppeteer, Input(3, Input.VELOCITY, leg, number, 16_000 * number, (0.5, 0.0, 0.0)))
            count = len([m for m in audience.messages if isinstance(m, Overlay)])
            await audience.wait_for(count + 1, Overlay)
        stage.receive(aiko.puppeteer, Release(0, hand))
        stage.receive(ben.puppeteer, Release(3, leg))
        await audience.wait_until_at_rest()
    published = [message for message in audience.messages if isinstance(message, Overlay)]
    log = SessionLog.unpack(stage.log.pack())
    assert list(log.messages()) == published
    assert any(overlay.limbs for overlay in published)
    assert list(log.timelines) == [stage.timeline]


def bonds_of(stage: Stage) -> list[list[int]] | None:
    return stage.presence.bonds


async def test_bonded_hands_are_published_logged_and_handed_back(stage: Stage, bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    aiko = join_stage(stage, "Aiko")
    stage.receive(aiko.puppeteer, Bond([0, 1], True))
    assert unpack(aiko.received[-1]) == BondEnd([0, 1], "owner")
    assert bonds_of(stage) is None
    stage.receive(aiko.puppeteer, Claim(0))
    stage.receive(aiko.puppeteer, Bond([1, 0], True))
    assert bonds_of(stage) == [[0, 1]]
    assert stage.presence.limbs == [aiko.id, None, None, None]
    epoch = last_grant(aiko).epoch
    for number in range(12):
        stage.receive(aiko.puppeteer, Input(0, Input.TARGET, epoch, number, 16_000 * number, (-0.1, 0.0, 0.5)))
        await audience.wait_for(len([m for m in audience.messages if isinstance(m, Overlay)]) + 1, Overlay)
    stage.receive(aiko.puppeteer, Release(0, epoch))
    assert BondEnd([0, 1], "released") in map(unpack, aiko.received)
    assert bonds_of(stage) is None
    await audience.wait_until_at_rest()
    published = [message for message in audience.messages if isinstance(message, Overlay)]
    assert {0, 1} in [set(overlay.limbs) for overlay in published]
    assert list(SessionLog.unpack(stage.log.pack()).messages()) == published


async def test_bond_of_dancers_far_apart_ends_with_the_reason(bus: MemoryBus) -> None:
    motion, audience = MOTIONS["both"], StageMessages(bus)
    state = timeline.start("both", motion.first_track.duration_us, clock())
    stage = Stage(SessionStart("s", motion, state, state.clock), bus, clock)
    aiko = join_stage(stage, "Aiko")
    stage.receive(aiko.puppeteer, Claim(0))
    stage.receive(aiko.puppeteer, Bond([0, 5], True))
    assert bonds_of(stage) == [[0, 5]]
    async with keep_holding(stage, aiko, 0):
        await audience.wait_for(4, Overlay)
    assert BondEnd([0, 5], "apart") in map(unpack, aiko.received)
    assert bonds_of(stage) is None
    assert stage.presence.limbs[0] == aiko.id
    await stage.close()


async def test_limb_stays_held_during_a_server_stall(stage: Stage, bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    aiko = join_stage(stage, "Aiko")
    stage.receive(aiko.puppeteer, Claim(0))
    async with keep_holding(stage, aiko, 0):
        shown = len(await audience.wait_for(2, Overlay))
    # the event loop is blocked for longer than the input timeout; Aiko's messages wait at the socket
    time.sleep(1.5e-6 * INPUT_TIMEOUT_US)  # noqa: ASYNC251 - blocks the event loop on purpose
    await audience.wait_for(shown + 1, Overlay)
    async with keep_holding(stage, aiko, 0):
        await audience.wait_for(shown + 8, Overlay)
    assert stage.presence.limbs[0] == aiko.id


async def test_takeover_publishes_timeline_presence_and_an_empty_overlay(stage: Stage, bus: MemoryBus) -> None:
    audience = StageMessages(bus)
    stage.announce()
    state, presence, overlay = audience.messages
    assert state == stage.timeline
    assert isinstance(presence, Presence)
    assert presence.limbs == [None] * 4
    assert isinstance(overlay, Overlay)
    assert overlay.limbs == {}
    assert overlay.due > clock()
