from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.timeline import TimelineHistory, change_motion, edit, position_at, start

NOW = 1_774_000_000_000_000
SECOND_US = 1_000_000
TIMES = st.integers(0, 500 * SECOND_US)


def test_position_advances_stops_at_end_and_loops() -> None:
    once = start("m", 10 * SECOND_US, NOW, loop=False)
    assert position_at(once, NOW - SECOND_US) == 0
    assert position_at(once, NOW + 3 * SECOND_US) == 3 * SECOND_US
    assert position_at(once, NOW + 30 * SECOND_US) == 10 * SECOND_US
    assert position_at(edit(once, NOW, loop=True), NOW + 33 * SECOND_US) == 3 * SECOND_US


@given(TIMES, TIMES, st.booleans())
def test_pause_and_play_keep_position(played: int, paused: int, loop: bool) -> None:
    state = start("m", 7 * SECOND_US, NOW, loop=loop)
    stopped = edit(state, NOW + played, playing=False)
    later = NOW + played + paused
    assert position_at(stopped, later) == position_at(state, NOW + played)
    again = edit(stopped, later, playing=True)
    expected = position_at(stopped, later)
    assert position_at(again, later) == (0 if not loop and expected == 7 * SECOND_US else expected)
    assert (state.epoch, stopped.epoch, again.epoch) == (1, 2, 3)


def test_seek_is_clamped_to_motion() -> None:
    state = start("m", 10 * SECOND_US, NOW, loop=False)
    assert position_at(edit(state, NOW, position=99 * SECOND_US), NOW) == 10 * SECOND_US
    assert position_at(edit(state, NOW, position=4 * SECOND_US), NOW + SECOND_US) == 5 * SECOND_US


def test_motion_change_starts_at_beginning_with_next_epoch() -> None:
    state = edit(start("m", 10 * SECOND_US, NOW), NOW + SECOND_US, playing=False)
    changed = change_motion(state, NOW + 2 * SECOND_US, "n", 5 * SECOND_US)
    assert (changed.motion, changed.duration, changed.epoch, changed.playing) == ("n", 5 * SECOND_US, 3, False)
    assert position_at(changed, NOW + 4 * SECOND_US) == 0


def test_motion_without_length_is_rejected() -> None:
    with pytest.raises(ValueError, match="length"):
        start("m", 0, NOW)


def test_previous_timeline_applies_until_newest_begins() -> None:
    timelines = TimelineHistory()
    first = start("m", 10 * SECOND_US, NOW)
    second = edit(first, NOW + 2 * SECOND_US, position=7 * SECOND_US)
    timelines.put(first)
    timelines.put(second)
    timelines.put(first)
    assert timelines.at(NOW + SECOND_US) == first
    assert timelines.at(NOW + 2 * SECOND_US) == second
    assert timelines.newest == second


def test_restart_accepts_timeline_of_older_epoch() -> None:
    timelines = TimelineHistory()
    timelines.put(edit(edit(start("m", 9_000_000, 0), 5), 6))
    restarted = start("m", 9_000_000, 7)
    timelines.put(restarted)
    assert timelines.newest != restarted
    timelines.restart()
    timelines.put(restarted)
    assert timelines.newest == restarted
    TimelineHistory().restart()
