"""Viewers in step are sent what each would be sent alone."""

from __future__ import annotations

import pytest

from bunraku.backing.backing import clock
from bunraku.backing.library import StoredMotion
from bunraku.playout import timeline
from bunraku.stream import viewers
from bunraku.wire.messages import Report
from tests.stream.watching import Audience, Watched, filmed


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return filmed(9.2, 7.1, 9.2)


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
