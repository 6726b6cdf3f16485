"""A crowd on the stage, from the viewers' pulls at a stream replica to the published overlay and the log."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial

import numpy as np

from bunraku.codec import motion_decoder
from bunraku.marionette.crowd.crowd_limb import SUMMARY_LIFETIME_US
from bunraku.messaging.bus import MemoryBus
from bunraku.playout import timeline
from bunraku.playout.session_log import SessionLog
from bunraku.session.control.crowd_control import CROWD
from bunraku.session.schema import SessionEdit
from bunraku.session.session_registry import SessionRecord
from bunraku.session.session_start import Fittings, SessionStart
from bunraku.session.stage import Stage
from bunraku.stream.crowd_relay import CrowdRelay
from bunraku.wire.messages import Presence, Pull, unpack
from bunraku.wire.overlay import Overlay
from tests.session.joined_stage import StageMessages, stored_motion
from tests.virtual_time import run_in_virtual_time


def test_pulls_of_two_replicas_move_an_open_limb_and_are_logged() -> None:
    shown: list[Overlay] = []
    logged: list[object] = []
    holders: list[tuple[str | None, ...]] = []

    async def pull(clock: Callable[[], int]) -> None:
        await asyncio.to_thread(motion_decoder.warm_up)
        bus, motion = MemoryBus(), stored_motion("one", 5)
        state = timeline.start("one", motion.first_track.duration_us, clock())
        stage = Stage(SessionStart("s", motion, state, state.clock, fittings=Fittings({1: "median"}, {})), bus, clock)
        audience = StageMessages(bus)
        relays: list[CrowdRelay[int]] = [
            CrowdRelay(name, clock, lambda data: bus.publish("session.s.crowd", data)) for name in "ab"
        ]
        for relay in relays:
            bus.subscribe("session.s.presence", partial(_forward_presence, relay))
            relay.set_presence(stage.presence)
        for _ in range(20):
            for member in range(6):
                relays[member % 2].pull(member, Pull(1, [0.3, 0.5, 0.1 * member]))
            await asyncio.sleep(0.05)
        holders.append(stage.holders)
        await audience.wait_until_at_rest()
        holders.append(stage.holders)
        shown.extend(m for m in audience.messages if isinstance(m, Overlay))
        logged.extend(SessionLog.unpack(stage.log.pack()).messages())
        assert [m.crowd for m in audience.messages if isinstance(m, Presence)][-1] == [
            {"limb": 1, "policy": "median", "pulls": 0}
        ]
        for relay in relays:
            relay.close()
        await stage.close()

    run_in_virtual_time(pull)
    assert holders == [(None, CROWD, None, None), (None,) * 4]
    assert {tuple(one.limbs) for one in shown} == {(1,), ()}
    assert logged == shown
    assert SUMMARY_LIFETIME_US < 500_000
    joints = np.array([one.limbs[1] for one in shown if one.limbs])
    assert np.ptp(joints, axis=0).max() > 1_000


def _forward_presence(relay: CrowdRelay[int], data: bytes) -> None:
    presence = unpack(data)
    assert isinstance(presence, Presence)
    relay.set_presence(presence)


def test_edit_opens_and_closes_limbs_by_name_and_number() -> None:
    edit = SessionEdit.model_validate({"crowd": {"right_hand": "median", "5": "vote", "left_leg": None}})
    assert edit.open_limbs({2: "turns", 0: "turns"}) == {0: "turns", 1: "median", 5: "vote"}
    assert SessionEdit(playing=True).open_limbs({3: "turns"}) == {3: "turns"}
    assert SessionEdit.model_validate(edit.model_dump(mode="json", exclude_unset=True)) == edit


def test_record_keeps_open_limbs() -> None:
    state = timeline.start("m", 5, 1).pack()
    record = SessionRecord("owner", 5, state, crowd=((1, "median"),))
    assert SessionRecord.unpack(record.pack()) == record
