from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest

from bunraku.messaging.performance_request import PERFORMANCE_SUBJECT, performed_subject
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from bunraku.playout import timeline
from bunraku.playout.performance import pack_sample
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.session.live.cast import Cast, CastMember
from bunraku.session.live.cast_store import CastStore
from bunraku.session.live.performer_endpoint import (
    RECONNECT_TIMEOUT_US,
    REFRESH_INTERVAL_US,
    REPLACED_LIFETIME_US,
    PerformerEndpoint,
)
from bunraku.session.session_start import SessionStart
from bunraku.session.stage import Stage
from bunraku.session.stage_proxy import StageProxy
from bunraku.storage.motion_store import MotionStore
from tests.time_limit import HANG_TIMEOUT_S

AIKO = CastMember("s-aiko", "Aiko", 60.0, None)
REST = np.array([0.0, 0.9, 0.0]), np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


class Editor:
    """Editor that applies changes of the cast, or refuses them."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.casts: list[Cast] = []
        self.motions: list[str] = []
        self.fails = False

    async def change_cast(self, cast: Cast) -> None:
        if self.fails:
            raise ProblemError(503, "Session elsewhere", "another server has taken over this session")
        self.casts.append(cast)
        self.stage.change_cast(cast)

    async def change_motion(self, motion: str) -> None:
        self.motions.append(motion)


class Owner:
    """Manager of a replica that may be full."""

    def __init__(self, casts: CastStore) -> None:
        self.casts = casts
        self.is_full = False

    def require_room(self, subject: str) -> None:
        if self.is_full:
            raise ProblemError(503, "Too many performers", f"no room for {subject}")


class Opened:
    """Endpoint of a stage with one performer and a clock that a test moves forward."""

    def __init__(self, context: ServiceContext) -> None:
        self.context = context
        self.ahead_us = 0
        self.stage: Stage
        self.editor: Editor
        self.endpoint: PerformerEndpoint
        self.requested: list[str] = []
        self.told: list[str] = []
        self.proxy = StageProxy("s", context.bus, context.key_values)
        context.bus.subscribe(PERFORMANCE_SUBJECT, lambda performer: self.requested.append(performer.decode()))
        context.bus.subscribe("session.s.performer.s-aiko", lambda told: self.told.append(told.decode()))

    def clock(self) -> int:
        return self.context.clock() + self.ahead_us

    async def open(self) -> None:
        casts = CastStore(self.context.motion_store)
        await casts.put_figure(AIKO, standard_figure())
        cast = Cast("", (AIKO,))
        motion = await casts.load(cast)
        state = timeline.start(motion.id, motion.first_track.duration_us, self.clock())
        self.stage = Stage(SessionStart("s", motion, state, state.clock, cast=cast), self.context.bus, self.clock)
        self.editor = Editor(self.stage)
        self.owner = Owner(casts)
        self.endpoint = PerformerEndpoint(self.stage, self.context, self.editor, self.owner)
        self.endpoint._clock = self.clock

    async def close(self) -> None:
        await self.endpoint.close()
        await self.stage.close()

    def applied(self) -> int:
        performer = self.stage.live.find(AIKO.id)
        return performer.outcomes["applied"] if performer is not None else -1


@pytest.fixture
async def opened(tmp_path: Path) -> AsyncIterator[Opened]:
    async with open_context(Settings(data=tmp_path)) as context:
        stage = Opened(context)
        await stage.open()
        yield stage
        await stage.close()


def sample(opened: Opened, number: int = 0) -> bytes:
    return pack_sample(opened.clock() + number, REST).pack()


async def until(condition: object) -> None:
    """Wait until a function returns true."""
    assert callable(condition)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0)


async def test_attached_connection_is_applied_and_others_are_told(opened: Opened) -> None:
    await opened.endpoint.operations["attach"]([AIKO.id, "one"])
    opened.proxy.send_sample(AIKO.id, "one", sample(opened))
    assert opened.applied() == 1
    await opened.endpoint.operations["attach"]([AIKO.id, "two"])
    opened.proxy.send_sample(AIKO.id, "one", sample(opened, 1))
    assert opened.applied() == 1
    assert opened.told == ["one", "two", "two"]
    description = await opened.endpoint.operations["performer"](AIKO.id)
    assert (description["name"], description["performer"], description["connected"]) == ("Aiko", 0, True)


async def test_performer_that_finds_no_room_changes_nothing(opened: Opened) -> None:
    yuki = CastMember("s-yuki", "Yuki", 60.0, None)
    await opened.owner.casts.put_figure(yuki, standard_figure())
    (values,) = Cast("", (yuki,)).to_values()[1]
    opened.owner.is_full = True
    with pytest.raises(ProblemError, match="no room"):
        await opened.endpoint.operations["perform"](values)
    assert opened.editor.casts == []
    opened.owner.is_full = False
    opened.editor.fails = True
    with pytest.raises(ProblemError, match="taken over"):
        await opened.endpoint.operations["perform"](values)
    with pytest.raises(ProblemError) as unknown:
        await opened.endpoint.operations["performer"](yuki.id)
    assert unknown.value.status == 404


async def test_connection_that_is_heard_after_a_take_over_is_the_performers(opened: Opened) -> None:
    opened.proxy.send_sample(AIKO.id, "one", sample(opened))
    assert (opened.applied(), opened.told) == (1, ["one"])


async def test_unknown_performer_is_told_that_the_performance_has_ended(opened: Opened) -> None:
    told: list[bytes] = []
    opened.context.bus.subscribe("session.s.performer.s-other", told.append)
    opened.proxy.send_sample("s-other", "one", sample(opened))
    assert told == [b""]
    for operation in ("performer", "unperform"):
        with pytest.raises(ProblemError) as unknown:
            await opened.endpoint.operations[operation]("s-other")
        assert unknown.value.status == 404


async def test_end_waits_for_the_last_samples_and_requests_the_motion(opened: Opened) -> None:
    opened.proxy.send_sample(AIKO.id, "one", sample(opened))
    ending = asyncio.ensure_future(opened.endpoint.operations["unperform"](AIKO.id))
    await until(lambda: "" in opened.told)
    assert opened.requested == []
    opened.proxy.send_sample(AIKO.id, "one", None)
    await ending
    assert opened.requested == [AIKO.id]
    assert opened.editor.casts == [Cast()]
    # the stage, which was opened for the performer, shows its motion when that is made
    opened.context.bus.publish(performed_subject(AIKO.id), b"performed")
    await until(lambda: opened.editor.motions)
    assert opened.editor.motions == ["performed"]


async def test_performer_without_a_connection_ends_by_itself(opened: Opened, caplog: pytest.LogCaptureFixture) -> None:
    opened.proxy.send_sample(AIKO.id, "one", sample(opened))
    opened.proxy.send_sample(AIKO.id, "one", None)
    opened.ahead_us = RECONNECT_TIMEOUT_US // 2
    opened.endpoint.expire(0)
    assert opened.endpoint._endings == {}
    # a heartbeat
    opened.proxy.send_sample(AIKO.id, "two", b"")
    opened.proxy.send_sample(AIKO.id, "two", None)
    opened.ahead_us += RECONNECT_TIMEOUT_US + 1_000_000
    # nothing could be received meanwhile
    opened.endpoint.expire(RECONNECT_TIMEOUT_US)
    assert opened.endpoint._endings == {}
    opened.editor.fails = True
    opened.ahead_us += RECONNECT_TIMEOUT_US
    opened.endpoint.expire(0)
    await until(lambda: not opened.endpoint._endings)
    assert "trying again" in caplog.text
    opened.editor.fails = False
    opened.endpoint.expire(0)
    opened.endpoint.expire(0)
    await until(lambda: opened.requested)
    assert opened.requested == [AIKO.id]


async def test_motions_of_a_former_cast_are_removed_after_a_while(opened: Opened) -> None:
    motions: MotionStore = opened.context.motion_store
    former = Cast("", (CastMember("s-gone", "", 60.0, None),))
    casts = CastStore(motions)
    await casts.put_figure(former.members[0], standard_figure())
    await casts.load(former)
    opened.endpoint.replace(former)
    await opened.endpoint.maintain()
    assert await motions.object_sizes([former.motion]) != [None]
    opened.ahead_us = REPLACED_LIFETIME_US + 1_000_000
    await opened.endpoint.maintain()
    assert await motions.object_sizes([former.motion, former.members[0].rest_motion]) == [None, None]
    assert None not in await motions.object_sizes([opened.stage.cast.motion, AIKO.rest_motion])
    opened.ahead_us = REFRESH_INTERVAL_US + 1_000_000
    await opened.endpoint.maintain()
    await opened.endpoint.remove_motions()
    assert await motions.object_sizes([AIKO.rest_motion]) == [None]
