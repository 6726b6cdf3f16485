from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.timing import Timing, even_blocks
from bunraku.playout.pacing import (
    AFTER,
    AHEAD,
    JUST,
    MARGIN,
    NET,
    NET_AHEAD,
    SAFE,
    SOON,
    UPGRADE,
    Due,
    Paced,
    Pacer,
    arrivals,
)
from bunraku.playout.timeline import edit, start
from bunraku.wire.messages import TimelineState
from tests.playout.pacers import CAMERA, LONG, SECOND, TRACK, alone, beside


def drain_all(pacer: Pacer, state: TimelineState, clock: int, rate: int) -> list[Due]:
    sent = []
    while (due := pacer.next(state, clock, rate)) is not None:
        sent.append(due)
        assert len(sent) < 100
    return sent


def drain(pacer: Pacer, state: TimelineState, clock: int, rate: int) -> list[tuple[int, int]]:
    return [(due.index, due.rate) for due in drain_all(pacer, state, clock, rate)]


def test_it_starts_low_and_fills_what_lies_ahead() -> None:
    state = start("m", TRACK.duration_us, 0)
    assert drain(alone(), state, 0, 3) == [(0, 0), (1, 3), (2, 3), (3, 3), (4, 3)]


def test_nothing_is_sent_twice_over_two_rounds_but_the_quick_start() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = alone()
    sent = []
    for clock in range(0, 2 * TRACK.duration_us, 100_000):
        sent += drain(pacer, state, clock, 3)
    assert sorted(sent) == sorted([(0, 0), *((i, 3) for i in range(TRACK.blocks))])


def test_it_stops_at_the_end_without_a_loop_and_follows_a_seek() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False, position=10 * SECOND)
    pacer = alone()
    assert [index for index, _ in drain(pacer, state, 0, 2)] == [10, 11]
    assert drain(pacer, edit(state, 0, position=5 * SECOND), 0, 2)[0] == (5, 0)


@given(st.integers(0, 40 * SECOND), st.integers(-3, 9))
def test_the_block_on_show_always_comes_first(clock: int, rate: int) -> None:
    state = start("m", TRACK.duration_us, 0)
    due = alone().next(state, clock, rate)
    assert due is not None
    assert due.index == TRACK.block_at(clock % TRACK.duration_us)


def test_wait_ends_when_the_next_block_is_in_reach() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = alone()
    drain(pacer, state, 0, 3)
    wait = pacer.wait(state, 0)
    assert wait is not None
    assert drain(pacer, state, wait - 2_000, 3) == []
    assert drain(pacer, state, wait, 3) == [(AHEAD // SECOND + 1, 3)]
    assert pacer.wait(edit(state, 0, playing=False), 0) is None


def test_a_motion_without_rates_is_refused() -> None:
    with pytest.raises(ValueError, match="rate"):
        alone(0)


def test_the_base_motion_comes_first_then_camera_and_light_then_better_motion() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = beside(CAMERA, CAMERA)
    sent = [(due.track, due.index, due.rate) for due in drain_all(pacer, state, 0, 0)]
    assert sent == [(track, index, 0) for index in range(5) for track in range(3)]
    better = [(due.track, due.index, due.rate, due.better) for due in drain_all(pacer, state, 0, 3)]
    assert better == [(track, index, 3 if track == 0 else 2, True) for index in range(1, 5) for track in range(3)]
    # what is missing goes before what could only be better
    pacer = beside(CAMERA)
    drain_all(pacer, state, 0, 0)
    later = drain_all(pacer, state, SECOND, 3)
    assert [(due.track, due.index) for due in later[:2]] == [(0, 5), (1, 5)]
    assert all(due.better for due in later[2:])


def sounding(*timings: Timing) -> Pacer:
    """Of a motion, sound beside it, and scenes."""
    tracks = [Paced(0, TRACK, 4, True), Paced(1, even_blocks(30.0, 360), 3, False, audio=True)]
    return Pacer([*tracks, *(Paced(number, timing, 3, False) for number, timing in enumerate(timings, 2))])


def all_of(pacer: Pacer, state: TimelineState, rate: int, audio: int | None) -> list[tuple[int, int, int]]:
    sent = []
    while (due := pacer.next(state, 0, rate, audio=audio)) is not None:
        sent.append((due.track, due.index, due.rate))
        assert len(sent) < 100
    return sent


def test_of_one_instant_the_motion_goes_first_then_the_sound_then_scenes_and_the_first_of_both_is_the_lowest() -> None:
    state = start("m", TRACK.duration_us, 0)
    sent = all_of(sounding(CAMERA), state, 3, 1)
    assert sent[:3] == [(0, 0, 0), (1, 0, 0), (2, 0, 2)]
    assert sent[3:] == [(track, index, rate) for index in range(1, 5) for track, rate in ((0, 3), (1, 1), (2, 2))]


def test_in_a_loop_sound_is_bettered_as_it_comes_near_again() -> None:
    for seconds in (2.0, 4.5, 5.5, 12.0):
        timing = even_blocks(30.0, round(30 * seconds))
        state = start("m", timing.duration_us, 0)
        pacer = Pacer([Paced(0, timing, 1, True), Paced(1, timing, 3, False, audio=True)])
        sent = []
        for clock in range(0, 3 * timing.duration_us, 100_000):
            while (due := pacer.next(state, clock, 0, audio=0 if clock < timing.duration_us else 2)) is not None:
                sent.append((due.track, due.index, due.rate))
        sound = [(index, rate) for track, index, rate in sent if track == 1]
        assert sorted(sound) == [(index, rate) for index in range(timing.blocks) for rate in (0, 2)]


def test_sound_has_a_rate_of_its_own_and_may_be_left_out() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = sounding()
    assert {track for track, _, _ in all_of(pacer, state, 1, -1)} == {0}
    # what was left out is missing: it goes before what could only be better
    later = all_of(pacer, state, 3, 0)
    assert later == [*((1, index, 0) for index in range(5)), *((0, index, 3) for index in range(1, 5))]
    # better sound only where it is far off, not all that waits already
    assert all_of(pacer, state, 3, 2) == [(1, 4, 2)]
    assert {rate for track, _, rate in all_of(sounding(), state, 1, None) if track == 1} == {0, 1}


def test_a_viewer_of_the_camera_alone_is_sent_that() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = Pacer([Paced(1, CAMERA, 3, False)])
    assert [(due.track, due.index, due.rate) for due in drain_all(pacer, state, 0, 3)] == [(1, i, 2) for i in range(5)]
    assert Pacer([]).next(state, 0, 3) is None
    assert Pacer([]).wait(state, 0) is None


@given(
    st.integers(1, 1500),
    st.sampled_from([24.0, 30.0, 59.94]),
    st.integers(0, 11_999_999),
    st.integers(0, 3),
    st.booleans(),
)
def test_a_scene_of_any_length_is_sent_whole_once_in_time_and_never_again(
    frames: int, fps: float, position: int, rate: int, loop: bool
) -> None:
    timing = even_blocks(fps, frames)
    state = start("m", TRACK.duration_us, 0, position=position, loop=loop)
    pacer = Pacer([Paced(1, timing, 4, False)])
    sent: list[int] = []
    clock = 0
    while clock < 2 * TRACK.duration_us:
        sent += [due.index for due in drain_all(pacer, state, clock, rate)]
        where = position + clock
        on_show = min(where, TRACK.duration_us) if not loop else where % TRACK.duration_us
        assert timing.block_at(min(on_show, TRACK.duration_us - 1)) in sent
        wait = pacer.wait(state, clock)
        assert wait is not None
        assert wait > 0
        clock += wait
    shown = timing.block_at(TRACK.duration_us - 1) + 1
    assert sorted(sent) == list(range(0 if loop else timing.block_at(position), shown))


@given(st.integers(0, 11_999_999), st.integers(0, 3), st.integers(0, 3))
def test_what_is_sent_again_is_better_and_can_still_be_used(position: int, before: int, rate: int) -> None:
    state = start("m", TRACK.duration_us, 0, position=position)
    pacer = beside(CAMERA)
    had = {(due.track, due.index): due.rate for due in drain_all(pacer, state, 0, before)}
    for due in drain_all(pacer, state, 0, rate):
        assert due.better
        assert due.distance > UPGRADE
        assert due.rate > had[due.track, due.index]


def test_a_net_goes_before_what_is_not_shown_at_once_and_is_filled_again_in_one_go() -> None:
    state = start("m", 60 * SECOND, 0)
    pacer = Pacer([Paced(0, LONG, 5, True)])
    sent = []
    while (due := pacer.next(state, 0, 4, net=True)) is not None:
        sent.append((due.index, due.rate))
    net = [index for index, rate in sent if rate == 0]
    assert net == sorted(net)
    assert LONG.start_us(max(net)) <= NET < LONG.start_us(max(net) + 1)
    last = sent.index((max(net), 0))
    bettered = [LONG.start_us(index) for index, rate in sent[:last] if rate == 4]
    assert max(bettered) <= JUST
    first = sent.index((0, 4)) if (0, 4) in sent else sent.index((1, 4))
    assert max(LONG.start_us(index) for index, _ in sent[:first]) > SAFE - 2 * SECOND
    assert max(LONG.start_us(index) for index, rate in sent if rate == 4) <= NET_AHEAD
    # it is left until it reaches less far than it should, and then filled up
    fills = []
    for clock in range(0, 25 * SECOND, SECOND):
        low = 0
        while (due := pacer.next(state, clock, 4, net=True)) is not None:
            low += due.rate == 0
        if low:
            fills.append(low)
    assert min(fills) >= 9
    assert len(fills) <= 3


@given(st.integers(0, 59 * SECOND), st.integers(1, 4))
def test_until_something_may_be_bettered_the_net_alone_is_sent(position: int, rate: int) -> None:
    state = start("m", 60 * SECOND, 0, position=position)
    pacer = Pacer([Paced(0, LONG, 5, True)])
    sent = list(iter(lambda: pacer.next(state, 0, rate, net=True, better=False), None))
    assert {due.rate for due in sent} == {0}
    assert len({due.index for due in sent}) == len(sent) >= NET // SECOND
    better = list(iter(lambda: pacer.next(state, 0, rate, net=True), None))
    assert better
    assert all(due.better and due.rate == rate for due in better)


@given(st.integers(0, 59 * SECOND), st.integers(1, 4))
def test_without_room_to_spare_only_what_is_missing_soon_goes(position: int, rate: int) -> None:
    state = start("m", 60 * SECOND, 0, position=position)
    pacer = Pacer([Paced(0, LONG, 5, True)])
    while (due := pacer.next(state, 0, rate, net=True, spare=False)) is not None:
        assert not due.better
        assert due.distance <= SOON
        assert due.rate == 0


@given(st.lists(st.integers(-1, 4), min_size=5, max_size=5), st.booleans())
def test_what_a_viewer_has_is_not_sent_again(rates: list[int], net: bool) -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = Pacer([Paced(0, TRACK, 5, True)])
    for index, rate in enumerate(rates):
        if rate >= 0:
            pacer.has(0, index, rate)
    while (due := pacer.next(state, 0, 3, net=net)) is not None:
        assert due.index >= len(rates) or due.rate > rates[due.index]


def told_by_next(
    tracks: list[Paced], state: TimelineState, clock: int, rate: int, audio: int | None
) -> list[tuple[int, int, int]]:
    """What comes within reach by `clock` for one who was sent, one by one, all that was before."""
    pacer = Pacer(tracks)
    while pacer.next(state, clock - 2 * MARGIN, rate, audio) is not None:
        pass
    found = []
    while (due := pacer.next(state, clock, rate, audio)) is not None:
        found.append((due.track, due.index, due.rate))
    return found


@given(
    st.lists(
        st.tuples(st.sampled_from([24.0, 30.0, 59.94]), st.integers(20, 700), st.integers(10, 90)),
        min_size=1,
        max_size=3,
    ),
    st.integers(0, 20_000_000),
    st.booleans(),
    st.integers(0, 2),
    st.sampled_from([None, -1, 0, 1]),
)
def test_arrivals_are_what_one_who_has_all_before_is_sent(
    shapes: list[tuple[float, int, int]], begin: int, loop: bool, rate: int, audio: int | None
) -> None:
    timings = [Timing(fps, frames, min(block, frames), min(block // 2, frames)) for fps, frames, block in shapes]
    tracks = [Paced(n, timing, 3, n == 0, n == 1) for n, timing in enumerate(timings)]
    state = TimelineState(1, "one", 0, 0, True, loop, timings[0].duration_us)
    clock = begin + (Pacer(tracks).wait(state, begin) or 0)
    told = [(due.track, due.index, due.rate) for due in arrivals(tracks, state, clock, rate, audio)]
    assert told == told_by_next(tracks, state, clock, rate, audio)


def test_over_a_narrow_line_the_motion_goes_a_while_ahead_of_sound_and_late_sound_is_left_out() -> None:
    pacer = Pacer([Paced(0, LONG, 4, True), Paced(1, LONG, 3, False, audio=True)])
    state = start("m", LONG.duration_us, 0)
    sent: list[tuple[int, int]] = []
    while (due := pacer.next(state, 500_000, 2, 1, net=True)) is not None and not due.far:
        if not due.better:
            sent.append((due.track, LONG.start_us(due.index)))
    sound = [at for track, at in sent if track == 1]
    assert SECOND <= min(sound) < 2 * SECOND
    for at in sound:
        before = [there for track, there in sent[: sent.index((1, at))] if track == 0]
        assert max(before) > min(at + AFTER, 500_000 + SOON) - 2 * SECOND
