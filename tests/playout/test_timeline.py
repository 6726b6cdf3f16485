from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.timeline import TimelineHistory, change_motion, edit, position_at, start

NOW = 1_774_000_000_000_000
SECOND = 1_000_000
TIMES = st.integers(0, 500 * SECOND)


def test_it_plays_stops_at_the_end_and_loops() -> None:
    once = start("m", 10 * SECOND, NOW, loop=False)
    assert position_at(once, NOW - SECOND) == 0
    assert position_at(once, NOW + 3 * SECOND) == 3 * SECOND
    assert position_at(once, NOW + 30 * SECOND) == 10 * SECOND
    assert position_at(edit(once, NOW, loop=True), NOW + 33 * SECOND) == 3 * SECOND


@given(TIMES, TIMES, st.booleans())
def test_pause_and_play_lose_nothing(played: int, paused: int, loop: bool) -> None:
    state = start("m", 7 * SECOND, NOW, loop=loop)
    stopped = edit(state, NOW + played, playing=False)
    later = NOW + played + paused
    assert position_at(stopped, later) == position_at(state, NOW + played)
    again = edit(stopped, later, playing=True)
    expected = position_at(stopped, later)
    assert position_at(again, later) == (0 if not loop and expected == 7 * SECOND else expected)
    assert (state.epoch, stopped.epoch, again.epoch) == (1, 2, 3)


def test_seeking_is_kept_within_the_motion() -> None:
    state = start("m", 10 * SECOND, NOW, loop=False)
    assert position_at(edit(state, NOW, position=99 * SECOND), NOW) == 10 * SECOND
    assert position_at(edit(state, NOW, position=4 * SECOND), NOW + SECOND) == 5 * SECOND


def test_another_motion_starts_from_its_beginning_with_the_next_epoch() -> None:
    state = edit(start("m", 10 * SECOND, NOW), NOW + SECOND, playing=False)
    other = change_motion(state, NOW + 2 * SECOND, "n", 5 * SECOND)
    assert (other.motion, other.duration, other.epoch, other.playing) == ("n", 5 * SECOND, 3, False)
    assert position_at(other, NOW + 4 * SECOND) == 0


def test_a_motion_without_length_is_refused() -> None:
    with pytest.raises(ValueError, match="length"):
        start("m", 0, NOW)


def test_the_timeline_before_holds_until_the_next_begins() -> None:
    timelines = TimelineHistory()
    first = start("m", 10 * SECOND, NOW)
    second = edit(first, NOW + 2 * SECOND, position=7 * SECOND)
    timelines.put(first)
    timelines.put(second)
    timelines.put(first)
    assert timelines.at(NOW + SECOND) == first
    assert timelines.at(NOW + 2 * SECOND) == second
    assert timelines.newest == second


def test_after_a_new_connection_its_first_timeline_counts() -> None:
    timelines = TimelineHistory()
    timelines.put(edit(edit(start("m", 9_000_000, 0), 5), 6))
    begun = start("m", 9_000_000, 7)
    timelines.put(begun)
    assert timelines.newest != begun
    timelines.restart()
    timelines.put(begun)
    assert timelines.newest == begun
    TimelineHistory().restart()
