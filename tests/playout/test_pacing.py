from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.track import MotionTrack, plan
from bunraku.playout.pacing import AHEAD, Pacer
from bunraku.playout.timeline import edit, start
from bunraku.wire.messages import TimelineState
from tests.vectors.blocks import wandering_motion

TRACK: MotionTrack = plan(wandering_motion(12.0, 30.0, 4))
SECOND = 1_000_000


def drain(pacer: Pacer, state: TimelineState, clock: int, rate: int) -> list[tuple[int, int]]:
    sent = []
    while (due := pacer.next(state, clock, rate)) is not None:
        sent.append(due)
        assert len(sent) < 100
    return sent


def test_it_starts_low_and_fills_what_lies_ahead() -> None:
    state = start("m", TRACK.duration_us, 0)
    assert drain(Pacer(TRACK, 4), state, 0, 3) == [(0, 0), (1, 3), (2, 3), (3, 3), (4, 3)]


def test_nothing_is_sent_twice_over_two_rounds_but_the_quick_start() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = Pacer(TRACK, 4)
    sent = []
    for clock in range(0, 2 * TRACK.duration_us, 100_000):
        sent += drain(pacer, state, clock, 3)
    assert sorted(sent) == sorted([(0, 0), *((i, 3) for i in range(TRACK.blocks))])


def test_it_stops_at_the_end_without_a_loop_and_follows_a_seek() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False, position=10 * SECOND)
    pacer = Pacer(TRACK, 4)
    assert [index for index, _ in drain(pacer, state, 0, 2)] == [10, 11]
    assert drain(pacer, edit(state, 0, position=5 * SECOND), 0, 2)[0] == (5, 0)


@given(st.integers(0, 40 * SECOND), st.integers(-3, 9))
def test_the_block_on_show_always_comes_first(clock: int, rate: int) -> None:
    state = start("m", TRACK.duration_us, 0)
    due = Pacer(TRACK, 4).next(state, clock, rate)
    assert due is not None
    assert due[0] == TRACK.block_at(clock % TRACK.duration_us)


def test_wait_ends_when_the_next_block_is_in_reach() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = Pacer(TRACK, 4)
    drain(pacer, state, 0, 3)
    wait = pacer.wait(state, 0)
    assert wait is not None
    assert drain(pacer, state, wait - 2_000, 3) == []
    assert drain(pacer, state, wait, 3) == [(AHEAD // SECOND + 1, 3)]
    assert pacer.wait(edit(state, 0, playing=False), 0) is None


def test_a_motion_without_rates_is_refused() -> None:
    with pytest.raises(ValueError, match="rate"):
        Pacer(TRACK, 0)
