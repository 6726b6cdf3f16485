"""Viewers who have one turn together are sent what each would be sent alone."""

from __future__ import annotations

import random

import pytest

from bunraku.backing.backing import clock
from bunraku.backing.frames import frame
from bunraku.backing.library import StoredMotion
from bunraku.playout import timeline
from bunraku.stream import viewers
from bunraku.wire.messages import Presence, Report
from tests.stream.watching import Audience, Watched, filmed

SECOND = 1_000_000


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return filmed(20.3, 17.1, 18.75)


def turn(one: Watched, now: int) -> None:
    """Its own turn, where it has one."""
    one.viewer.outlet.heard = now
    while (due := one.viewer._next_turn()) <= now and due < now + 8 * SECOND:
        one.viewer.advance()
        if one.viewer._next_turn() <= due:
            return


def turns(audience: Audience, now: int) -> None:
    """The turns of the cohorts that are due."""
    for cohort in audience.cohorts:
        while cohort.following is not None and cohort.following + cohort.phase <= now:
            cohort.advance()


@pytest.mark.parametrize("loop", [True, False])
async def test_each_is_sent_what_it_would_be_sent_alone(
    motion: StoredMotion, loop: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewers, "clock", lambda: now[0])
    monkeypatch.setattr(random, "randrange", lambda _: 0)
    audience = Audience()
    state = timeline.start(motion.id, motion.track.duration_us, began, loop=loop)
    pairs: list[tuple[Watched, Watched]] = []
    together = 0
    for step in range(500):
        # no step is at an instant at which something comes within reach
        now[0] = began + step * 100_000 + 37_000
        # they come at times of their own, also after the dance has begun again
        if step in (0, 3, 11, 40, 70, 230):
            pairs.append((Watched(motion, state, audience), Watched(motion, state, None)))
        if step == 120:
            state = timeline.edit(state, now[0], position=3_000_000)
        for pair in pairs:
            for one in pair:
                one.viewer.outlet.heard = now[0]
                if step == 120:
                    one.viewer.timeline(state, motion)
                if step in (20, 25):
                    one.viewer.hear(Report(buffer=3_000_000, hidden=step == 20).pack())
                if step in (20, 25, 120):
                    one.viewer.advance()
                turn(one, now[0])
        turns(audience, now[0])
        together += sum(one.viewer._in_step.cohort is not None for one, _ in pairs)
        for one, alone in pairs:
            assert one.sent() == alone.sent()
    assert together > 300


async def test_who_leaves_has_what_it_was_sent_and_a_cohort_ends_with_its_last(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewers, "clock", lambda: now[0])
    monkeypatch.setattr(random, "randrange", lambda _: 0)
    audience = Audience()
    state = timeline.start(motion.id, motion.track.duration_us, began)
    one = Watched(motion, state, audience)
    assert [cohort.phase // 20_000 for cohort in audience.cohorts] == [one.viewer._phase // 20_000]
    before = one.sent()
    now[0] = began + 5 * SECOND
    turns(audience, now[0])
    sent = one.sent()
    assert len(sent) > len(before)
    # no room: it is in step with nobody
    one.line.room = False
    one.viewer.control(frame(Presence(1, [], [None] * 4).pack()))
    assert not list(audience.cohorts)
    one.line.drain()
    assert one.sent() == sent
    assert [one.viewer._in_step.cohort] == list(audience.cohorts)
    one.viewer.gone()
    assert not list(audience.cohorts)
    assert audience.left == [one.viewer]


async def test_one_who_comes_between_two_instants_is_sent_the_next_and_not_the_last_again(
    motion: StoredMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    began = clock()
    now = [began]
    monkeypatch.setattr(viewers, "clock", lambda: now[0])
    audience = Audience()
    state = timeline.start(motion.id, motion.track.duration_us, began)
    one = Watched(motion, state, audience)
    (cohort,) = audience.cohorts
    assert cohort.following is not None
    # the next block has come within reach, but the cohort has not had its turn
    now[0] = cohort.following + 1_000
    monkeypatch.setattr(random, "randrange", lambda _: one.viewer._phase)
    two = Watched(motion, state, audience)
    assert [one.viewer._in_step.cohort, two.viewer._in_step.cohort] == [cohort, cohort]
    for _ in range(3):
        cohort.advance()
    assert len(two.sent()) == len(set(two.sent()))
    latest = max(one.sent())
    assert latest in two.sent()
