"""With whom one viewer is in step, and until when."""

from __future__ import annotations

import pytest

from bunraku.backing.backing import clock
from bunraku.backing.library import StoredMotion
from bunraku.playout import timeline
from bunraku.playout.pacing import MARGIN
from bunraku.stream.cohorts import Cohorts
from bunraku.stream.in_step import SPREAD, TOGETHER, InStep
from bunraku.stream.plans import Plans
from bunraku.stream.playing import Playing
from bunraku.stream.tracks import TRACKS
from bunraku.stream.turns import Turns
from bunraku.wire.messages import TimelineState
from tests.stream.watching import Audience, Watched, filmed


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    return filmed(20.3, 17.1, 18.75)


def sent_all(motion: StoredMotion, state: TimelineState, now: int) -> tuple[Playing, int]:
    """One who was sent all that is within reach, and when the next comes."""
    playing = Playing(motion, TRACKS, None)
    step = playing.step
    while playing.pacer.next(state, now, step.motion, step.audio) is not None:
        pass
    wait = playing.pacer.wait(state, now)
    assert wait is not None
    return playing, now + wait


async def test_it_lasts_as_long_as_nothing_comes_that_was_sent_before_and_the_rates_stay(motion: StoredMotion) -> None:
    now = clock()
    state = timeline.start(motion.id, motion.track.duration_us, now, loop=True)
    playing, following = sent_all(motion, state, now)
    member = Watched(motion, state, None).viewer
    step = InStep(member)
    assert not step.lasts(now, playing.step)
    assert step.join(Cohorts(Plans()), Turns(), state, playing, TRACKS, following, 0)
    assert step.cohort is not None
    assert now + TOGETHER - SPREAD <= step.until < now + motion.track.duration_us
    assert step.lasts(step.until - 1, playing.step)
    assert not step.lasts(step.until, playing.step)
    assert not step.lasts(now, playing.step._replace(motion=playing.step.motion + 1))


async def test_what_it_was_sent_there_is_not_sent_again(motion: StoredMotion) -> None:
    now = clock()
    state = timeline.start(motion.id, motion.track.duration_us, now, loop=True)
    playing, following = sent_all(motion, state, now)
    one = Watched(motion, state, Audience())
    step = InStep(one.viewer)
    assert step.join(Cohorts(Plans()), Turns(), state, playing, TRACKS, following, 0)
    cohort = step.cohort
    assert cohort is not None
    cohort.advance()
    cohort.advance()
    at = cohort.following
    assert at is not None
    step.leave(playing)
    assert step.cohort is None
    rates = playing.step
    assert playing.pacer.next(state, at - 2 * MARGIN, rates.motion, rates.audio) is None
    # nobody is in step with nobody
    step.leave(playing)


async def test_who_has_been_sent_what_comes_next_goes_on_alone(motion: StoredMotion) -> None:
    now = clock()
    state = timeline.start(motion.id, motion.track.duration_us, now, loop=True)
    playing, following = sent_all(motion, state, now)
    for index in range(motion.track.blocks):
        playing.pacer.has(0, index, playing.step.motion)
    step = InStep(Watched(motion, state, None).viewer)
    assert not step.join(Cohorts(Plans()), Turns(), state, playing, TRACKS, following, 0)
    assert step.cohort is None
