"""Props on a stage: requests of puppeteers, what viewers are told, the log, and what a server that takes over has."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

import pytest
from pydantic import ValidationError

from bunraku.codec import motion_decoder
from bunraku.messaging.bus import MemoryBus
from bunraku.motion.placement import Placement
from bunraku.playout import timeline
from bunraku.playout.session_log import SessionLog
from bunraku.session.control.prop_control import ROW_DISTANCE_M, PropControl
from bunraku.session.puppeteer_roster import PuppeteerRoster
from bunraku.session.schema import SessionEdit
from bunraku.session.session_registry import SessionRecord
from bunraku.session.session_start import Fittings, SessionStart
from bunraku.session.stage import Stage
from bunraku.wire.messages import Presence, PropRefusal, Put, unpack
from bunraku.wire.prop import Prop, PropState
from tests.session.joined_stage import StageMessages, join_stage, stored_motion
from tests.virtual_time import run_in_virtual_time

FAN = Prop("fan", PropState(None, Placement(0.5, 1.0, 0.25)))


def test_refused_request_is_answered_with_the_reason_and_changes_nothing() -> None:
    sent: list[bytes] = []
    roster = PuppeteerRoster()
    ada = roster.join("ada", "Ada", sent.append, 0)
    control = PropControl({0: FAN})
    assert not control.receive(ada, Put(3, limb=0), [None] * 4)
    assert not control.receive(ada, Put(0, limb=1), [None, "bo", None, None])
    assert [unpack(data) for data in sent] == [PropRefusal(3, "unknown"), PropRefusal(0, "held")]
    assert control.all == {0: FAN}
    assert not control.has_unsaved_moves


def test_turn_is_brought_within_a_circle() -> None:
    ada = PuppeteerRoster().join("ada", "Ada", print, 0)
    control = PropControl({0: FAN})
    assert control.receive(ada, Put(0, place=[-2.0, 0.5, 1.0 + 8 * math.pi]), [None] * 4)
    state = control.all[0].state
    assert (state.place.x, state.place.z) == (-2.0, 0.5)
    assert state.place.turn == pytest.approx(1.0)
    assert control.has_unsaved_moves


@pytest.mark.parametrize("turn", [0.0, 1.0, -2.5])
def test_new_props_lie_before_the_first_performer_and_apart(turn: float) -> None:
    control = PropControl({2: FAN})
    planned = control.plan(dict.fromkeys(range(8), "fan"), Placement(3.0, -1.0, turn))
    assert planned[2] == FAN
    places = [prop.state.place for number, prop in planned.items() if number != 2]
    ahead = [(place.x - 3) * math.sin(turn) + (place.z + 1) * math.cos(turn) for place in places]
    assert ahead == pytest.approx([ROW_DISTANCE_M] * 7)
    assert min(math.dist(a[:2], b[:2]) for a in places for b in places if a is not b) > 0.3


def test_viewers_and_the_log_are_told_where_props_are() -> None:
    shown: list[Presence] = []
    logs: list[tuple[SessionLog, list[int]]] = []

    async def play(clock: Callable[[], int]) -> None:
        await asyncio.to_thread(motion_decoder.warm_up)
        bus, motion = MemoryBus(), stored_motion("one", 5)
        state = timeline.start("one", motion.first_track.duration_us, clock())
        fittings = Fittings({}, {3: FAN})
        stage = Stage(SessionStart("s", motion, state, state.clock, fittings=fittings), bus, clock)
        audience = StageMessages(bus)
        times = []
        ada = join_stage(stage, "Ada")
        for request in (Put(3, limb=1), Put(3, limb=0), Put(3, place=[1.0, 2.0, 0.5])):
            await asyncio.sleep(1.0)
            stage.receive(ada.puppeteer, request)
            times.append(clock())
        await asyncio.sleep(1.0)
        stage.fit(Fittings({}, stage.plan_props({})))
        shown.extend(m for m in audience.messages if isinstance(m, Presence))
        logs.append((SessionLog.unpack(stage.log.pack()), times))
        assert stage.fittings == Fittings({}, {})
        await stage.close()

    run_in_virtual_time(play)
    assert shown[0].props == [{"prop": 3, "kind": "fan", "limb": None, "place": [0.5, 1.0, 0.25]}]
    limbs = [entry["limb"] for presence in shown for entry in presence.props or []]
    assert list(dict.fromkeys(limbs)) == [None, 1, 0]
    assert shown[-1].props is None
    ((log, times),) = logs
    assert [log.props_at(time)[3].state.limb for time in times] == [1, 0, None]
    assert log.props_at(times[0] - 1) == {3: FAN}
    assert log.props_at(times[2])[3].state.place == Placement(1.0, 2.0, 0.5)
    assert log.props_at(1 << 60) == {}


def test_edit_brings_and_removes_props() -> None:
    edit = SessionEdit.model_validate({"props": {"0": "fan", "7": "ball", "3": None}})
    assert edit.prop_kinds({3: "branch", 4: "umbrella"}) == {0: "fan", 4: "umbrella", 7: "ball"}
    assert SessionEdit.model_validate(edit.model_dump(mode="json", exclude_unset=True)) == edit
    for props in ({"8": "fan"}, {"0": "sword"}, {"left_hand": "fan"}, {"0": 1}):
        with pytest.raises(ValidationError):
            SessionEdit.model_validate({"props": props})


def test_record_keeps_props_and_is_read_without_them() -> None:
    state = timeline.start("m", 5, 1).pack()
    record = SessionRecord("owner", 5, state, props=((3, FAN), (5, Prop("ball", PropState(1)))))
    assert SessionRecord.unpack(record.pack()) == record
    assert SessionRecord.unpack(record._replace(props=()).pack()) == record._replace(props=())
