"""Viewers in step are sent what each would be sent alone."""

from __future__ import annotations

import numpy as np
import pytest

from bunraku.backing.backing import clock
from bunraku.backing.library import StoredMotion, pack, unpack, with_audio
from bunraku.codec.encode import encode_motion
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.opus import encode_audio
from bunraku.playout import timeline
from bunraku.stream import viewers
from bunraku.stream.cohorts import Cohorts
from bunraku.stream.plans import Plans
from bunraku.stream.turns import Turns
from bunraku.stream.viewers import Viewer
from bunraku.wire.messages import Data, Report, TimelineState
from tests.stream.lines import Line
from tests.vectors.blocks import wandering_motion
from tests.vectors.scene import camera


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    encoded = encode_motion(wandering_motion(9.2, 30.0, 9), ladder=(30.0, 5.0), grade="live")
    filmed = unpack("m", pack("m", encoded, [encode_scene(camera(7.1, 25.0), ladder=(20.0, 4.0))]))
    noise = np.random.default_rng(2).normal(0, 0.2, (441_600, 1)).astype(np.float32)
    return unpack("m", with_audio("m", filmed, encode_audio([noise], filmed.track, 1))[0])


class Audience:
    """Some who are in step."""

    def __init__(self) -> None:
        self.plans = Plans()
        self.cohorts = Cohorts(self.plans)

    def turned(self) -> None: ...

    def leave(self, viewer: Viewer) -> None: ...


class Watched:
    """One viewer, its turns taken by the test."""

    def __init__(self, motion: StoredMotion, state: TimelineState, audience: Audience | None) -> None:
        self.viewer, self.line = Viewer(Turns()), Line()
        self.viewer.audience = audience
        self.viewer.timeline(state, motion)
        self.viewer.open(self.line.outlet(self.viewer))

    def sent(self) -> list[tuple[int, int, int]]:
        return sorted((m.track, m.index, m.rate) for m in self.line.messages if isinstance(m, Data))


@pytest.mark.parametrize("loop", [True, False])
async def test_each_is_sent_what_it_would_be_sent_alone(
    motion: StoredMotion, loop: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewers, "clock", lambda: now[0])
    audience = Audience()
    state = timeline.start(motion.id, motion.track.duration_us, began, loop=loop)
    pairs: list[tuple[Watched, Watched]] = []
    made: list[int] = []
    for step in range(150):
        now[0] = began + step * 170_000
        # they come at times of their own, also after the dance has begun again
        if step in (0, 3, 11, 40, 70):
            pairs.append((Watched(motion, state, audience), Watched(motion, state, None)))
        if step == 50:
            state = timeline.edit(state, now[0], position=3_000_000)
        for together, alone in pairs:
            for one in (together, alone):
                one.viewer.outlet.heard = now[0]
                if step == 50:
                    one.viewer.timeline(state, motion)
                if step == 20:
                    one.viewer.hear(Report(buffer=3_000_000, hidden=True).pack())
                if step == 25:
                    one.viewer.hear(Report(buffer=3_000_000, hidden=False).pack())
                if step in (20, 25, 50) or one.viewer._following is None:
                    one.viewer.advance()
                # a turn for each instant at which something comes
                while one.viewer._following is not None and one.viewer._following <= now[0]:
                    one.viewer.advance()
        for cohort in audience.cohorts:
            while cohort.following is not None and cohort.following <= now[0]:
                cohort.advance()
        for together, alone in pairs:
            assert together.sent() == alone.sent()
        made.append(len(audience.plans._plans))
    assert max(made) > 3
    assert max(made) <= 64


async def test_one_without_room_is_not_asked_again_and_again(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewers, "clock", lambda: now[0])
    state = timeline.start(motion.id, motion.track.duration_us, began)
    one = Watched(motion, state, Audience())
    one.line.room = False
    one.viewer.control(b"\x82\x01\x7f")
    now[0] = began + 3_000_000
    one.viewer.advance()
    assert one.viewer._next_turn() > now[0] + 3_000_000
    before = len(one.sent())
    one.line.drain()
    assert len(one.sent()) > before
