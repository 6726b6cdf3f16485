from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.timing import Timing, plan_timing
from bunraku.delivery.block_scheduler import (
    CONSTRAINED_AUDIO_DELAY_US,
    MAX_PREFETCH_US,
    MIN_PREFETCH_US,
    MIN_UPGRADE_LEAD_US,
    SCHEDULING_MARGIN_US,
    SEND_AHEAD_US,
    UPGRADE_AHEAD_US,
    UPGRADE_FIRST_US,
    URGENT_PREFETCH_US,
    BlockScheduler,
    ScheduledBlock,
    ScheduledTrack,
    SendPolicy,
    newly_due_blocks,
)
from bunraku.playout.timeline import edit, start
from bunraku.wire.messages import TimelineState
from tests.delivery.schedulers import CAMERA, ONE_MINUTE, SECOND_US, TRACK, motion_and_scene_scheduler, motion_scheduler


def drain_all(pacer: BlockScheduler, state: TimelineState, clock: int, rate: int) -> list[ScheduledBlock]:
    sent = []
    while (due := pacer.next_block(state, clock, SendPolicy(rate))) is not None:
        sent.append(due)
        assert len(sent) < 100
    return sent


def drain(pacer: BlockScheduler, state: TimelineState, clock: int, rate: int) -> list[tuple[int, int]]:
    return [(due.index, due.level) for due in drain_all(pacer, state, clock, rate)]


def test_it_starts_low_and_fills_what_lies_ahead() -> None:
    state = start("m", TRACK.duration_us, 0)
    assert drain(motion_scheduler(), state, 0, 3) == [(0, 0), (1, 3), (2, 3), (3, 3), (4, 3)]


def test_nothing_is_sent_twice_over_two_rounds_but_the_quick_start() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = motion_scheduler()
    sent = []
    for clock in range(0, 2 * TRACK.duration_us, 100_000):
        sent += drain(pacer, state, clock, 3)
    assert sorted(sent) == sorted([(0, 0), *((i, 3) for i in range(TRACK.block_count))])


def test_it_stops_at_the_end_without_a_loop_and_follows_a_seek() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False, position=10 * SECOND_US)
    pacer = motion_scheduler()
    assert [index for index, _ in drain(pacer, state, 0, 2)] == [10, 11]
    assert drain(pacer, edit(state, 0, position=5 * SECOND_US), 0, 2)[0] == (5, 0)


@given(st.integers(0, 40 * SECOND_US), st.integers(-3, 9))
def test_the_block_on_show_always_comes_first(clock: int, rate: int) -> None:
    state = start("m", TRACK.duration_us, 0)
    due = motion_scheduler().next_block(state, clock, SendPolicy(rate))
    assert due is not None
    assert due.index == TRACK.block_at(clock % TRACK.duration_us)


def test_wait_ends_when_the_next_block_is_in_reach() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = motion_scheduler()
    drain(pacer, state, 0, 3)
    wait = pacer.time_until_next(state, 0)
    assert wait is not None
    assert drain(pacer, state, wait - 2_000, 3) == []
    assert drain(pacer, state, wait, 3) == [(SEND_AHEAD_US // SECOND_US + 1, 3)]
    assert pacer.time_until_next(edit(state, 0, playing=False), 0) is None


def test_a_motion_without_rates_is_refused() -> None:
    with pytest.raises(ValueError, match="rate"):
        motion_scheduler(0)


def test_the_base_motion_comes_first_then_camera_and_light_then_better_motion() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = motion_and_scene_scheduler(CAMERA, CAMERA)
    sent = [(due.track, due.index, due.level) for due in drain_all(pacer, state, 0, 0)]
    assert sent == [(track, index, 0) for index in range(5) for track in range(3)]
    better = [(due.track, due.index, due.level, due.is_upgrade) for due in drain_all(pacer, state, 0, 3)]
    assert better == [(track, index, 3 if track == 0 else 2, True) for index in range(1, 5) for track in range(3)]
    # what is missing goes before what could only be better
    pacer = motion_and_scene_scheduler(CAMERA)
    drain_all(pacer, state, 0, 0)
    later = drain_all(pacer, state, SECOND_US, 3)
    assert [(due.track, due.index) for due in later[:2]] == [(0, 5), (1, 5)]
    assert all(due.is_upgrade for due in later[2:])


def motion_and_audio_scheduler(*timings: Timing) -> BlockScheduler:
    """Of a motion, sound beside it, and scenes."""
    tracks = [ScheduledTrack(0, TRACK, 4, True), ScheduledTrack(1, plan_timing(30.0, 360), 3, False, is_audio=True)]
    return BlockScheduler(
        [*tracks, *(ScheduledTrack(number, timing, 3, False) for number, timing in enumerate(timings, 2))]
    )


def drain_levels(
    pacer: BlockScheduler, state: TimelineState, rate: int, audio: int | None
) -> list[tuple[int, int, int]]:
    sent = []
    while (due := pacer.next_block(state, 0, SendPolicy(rate, audio))) is not None:
        sent.append((due.track, due.index, due.level))
        assert len(sent) < 100
    return sent


def test_of_one_instant_the_motion_goes_first_then_the_sound_then_scenes_and_the_first_of_both_is_the_lowest() -> None:
    state = start("m", TRACK.duration_us, 0)
    sent = drain_levels(motion_and_audio_scheduler(CAMERA), state, 3, 1)
    assert sent[:3] == [(0, 0, 0), (1, 0, 0), (2, 0, 2)]
    assert sent[3:] == [(track, index, rate) for index in range(1, 5) for track, rate in ((0, 3), (1, 1), (2, 2))]


def test_in_a_loop_sound_is_bettered_as_it_comes_near_again() -> None:
    for seconds in (2.0, 4.5, 5.5, 12.0):
        timing = plan_timing(30.0, round(30 * seconds))
        state = start("m", timing.duration_us, 0)
        pacer = BlockScheduler([ScheduledTrack(0, timing, 1, True), ScheduledTrack(1, timing, 3, False, is_audio=True)])
        sent = []
        for clock in range(0, 3 * timing.duration_us, 100_000):
            while (
                due := pacer.next_block(state, clock, SendPolicy(0, 0 if clock < timing.duration_us else 2))
            ) is not None:
                sent.append((due.track, due.index, due.level))
        sound = [(index, rate) for track, index, rate in sent if track == 1]
        assert sorted(sound) == [(index, rate) for index in range(timing.block_count) for rate in (0, 2)]


def test_sound_has_a_rate_of_its_own_and_may_be_left_out() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = motion_and_audio_scheduler()
    assert {track for track, _, _ in drain_levels(pacer, state, 1, -1)} == {0}
    # what was left out is missing: it goes before what could only be better
    later = drain_levels(pacer, state, 3, 0)
    assert later == [*((1, index, 0) for index in range(5)), *((0, index, 3) for index in range(1, 5))]
    # better sound only where it is far off, not all that waits already
    assert drain_levels(pacer, state, 3, 2) == [(1, 4, 2)]
    assert {rate for track, _, rate in drain_levels(motion_and_audio_scheduler(), state, 1, None) if track == 1} == {
        0,
        1,
    }


def test_a_viewer_of_the_camera_alone_is_sent_that() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = BlockScheduler([ScheduledTrack(1, CAMERA, 3, False)])
    assert [(due.track, due.index, due.level) for due in drain_all(pacer, state, 0, 3)] == [(1, i, 2) for i in range(5)]
    assert BlockScheduler([]).next_block(state, 0, SendPolicy(3)) is None
    assert BlockScheduler([]).time_until_next(state, 0) is None


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
    timing = plan_timing(fps, frames)
    state = start("m", TRACK.duration_us, 0, position=position, loop=loop)
    pacer = BlockScheduler([ScheduledTrack(1, timing, 4, False)])
    sent: list[int] = []
    clock = 0
    while clock < 2 * TRACK.duration_us:
        sent += [due.index for due in drain_all(pacer, state, clock, rate)]
        where = position + clock
        on_show = min(where, TRACK.duration_us) if not loop else where % TRACK.duration_us
        assert timing.block_at(min(on_show, TRACK.duration_us - 1)) in sent
        wait = pacer.time_until_next(state, clock)
        assert wait is not None
        assert wait > 0
        clock += wait
    shown = timing.block_at(TRACK.duration_us - 1) + 1
    assert sorted(sent) == list(range(0 if loop else timing.block_at(position), shown))


@given(st.integers(0, 11_999_999), st.integers(0, 3), st.integers(0, 3))
def test_what_is_sent_again_is_better_and_can_still_be_used(position: int, before: int, rate: int) -> None:
    state = start("m", TRACK.duration_us, 0, position=position)
    pacer = motion_and_scene_scheduler(CAMERA)
    had = {(due.track, due.index): due.level for due in drain_all(pacer, state, 0, before)}
    for due in drain_all(pacer, state, 0, rate):
        assert due.is_upgrade
        assert due.lead_us > MIN_UPGRADE_LEAD_US
        assert due.level > had[due.track, due.index]


def test_a_net_goes_before_what_is_not_shown_at_once_and_is_filled_again_in_one_go() -> None:
    state = start("m", 60 * SECOND_US, 0)
    pacer = BlockScheduler([ScheduledTrack(0, ONE_MINUTE, 5, True)])
    sent = []
    while (due := pacer.next_block(state, 0, SendPolicy(4, prefetch=True))) is not None:
        sent.append((due.index, due.level))
    net = [index for index, rate in sent if rate == 0]
    assert net == sorted(net)
    assert ONE_MINUTE.start_us(max(net)) <= MAX_PREFETCH_US < ONE_MINUTE.start_us(max(net) + 1)
    last = sent.index((max(net), 0))
    bettered = [ONE_MINUTE.start_us(index) for index, rate in sent[:last] if rate == 4]
    assert max(bettered) <= UPGRADE_FIRST_US
    first = sent.index((0, 4)) if (0, 4) in sent else sent.index((1, 4))
    assert max(ONE_MINUTE.start_us(index) for index, _ in sent[:first]) > MIN_PREFETCH_US - 2 * SECOND_US
    assert max(ONE_MINUTE.start_us(index) for index, rate in sent if rate == 4) <= UPGRADE_AHEAD_US
    # it is left until it reaches less far than it should, and then filled up
    fills = []
    for clock in range(0, 25 * SECOND_US, SECOND_US):
        low = 0
        while (due := pacer.next_block(state, clock, SendPolicy(4, prefetch=True))) is not None:
            low += due.level == 0
        if low:
            fills.append(low)
    assert min(fills) >= 9
    assert len(fills) <= 3


@given(st.integers(0, 59 * SECOND_US), st.integers(1, 4))
def test_until_something_may_be_bettered_the_net_alone_is_sent(position: int, rate: int) -> None:
    state = start("m", 60 * SECOND_US, 0, position=position)
    pacer = BlockScheduler([ScheduledTrack(0, ONE_MINUTE, 5, True)])
    sent = list(iter(lambda: pacer.next_block(state, 0, SendPolicy(rate, prefetch=True, allow_upgrades=False)), None))
    assert {due.level for due in sent} == {0}
    assert len({due.index for due in sent}) == len(sent) >= MAX_PREFETCH_US // SECOND_US
    better = list(iter(lambda: pacer.next_block(state, 0, SendPolicy(rate, prefetch=True)), None))
    assert better
    assert all(due.is_upgrade and due.level == rate for due in better)


@given(st.integers(0, 59 * SECOND_US), st.integers(1, 4))
def test_without_room_to_spare_only_what_is_missing_soon_goes(position: int, rate: int) -> None:
    state = start("m", 60 * SECOND_US, 0, position=position)
    pacer = BlockScheduler([ScheduledTrack(0, ONE_MINUTE, 5, True)])
    while (due := pacer.next_block(state, 0, SendPolicy(rate, prefetch=True, has_spare_capacity=False))) is not None:
        assert not due.is_upgrade
        assert due.lead_us <= URGENT_PREFETCH_US
        assert due.level == 0


@given(st.lists(st.integers(-1, 4), min_size=5, max_size=5), st.booleans())
def test_what_a_viewer_has_is_not_sent_again(rates: list[int], net: bool) -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = BlockScheduler([ScheduledTrack(0, TRACK, 5, True)])
    for index, rate in enumerate(rates):
        if rate >= 0:
            pacer.mark_sent(0, index, rate)
    while (due := pacer.next_block(state, 0, SendPolicy(3, prefetch=net))) is not None:
        assert due.index >= len(rates) or due.level > rates[due.index]


def told_by_next(
    tracks: list[ScheduledTrack], state: TimelineState, clock: int, rate: int, audio: int | None
) -> list[tuple[int, int, int]]:
    """What comes within reach by `clock` for one who was sent, one by one, all that was before."""
    pacer = BlockScheduler(tracks)
    while pacer.next_block(state, clock - 2 * SCHEDULING_MARGIN_US, SendPolicy(rate, audio)) is not None:
        pass
    found = []
    while (due := pacer.next_block(state, clock, SendPolicy(rate, audio))) is not None:
        found.append((due.track, due.index, due.level))
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
    tracks = [ScheduledTrack(n, timing, 3, n == 0, n == 1) for n, timing in enumerate(timings)]
    state = TimelineState(1, "one", 0, 0, True, loop, timings[0].duration_us)
    clock = begin + (BlockScheduler(tracks).time_until_next(state, begin) or 0)
    told = [
        (due.track, due.index, due.level) for due in newly_due_blocks(tracks, state, clock, SendPolicy(rate, audio))
    ]
    assert told == told_by_next(tracks, state, clock, rate, audio)


def test_over_a_narrow_line_the_motion_goes_a_while_ahead_of_sound_and_late_sound_is_left_out() -> None:
    pacer = BlockScheduler(
        [ScheduledTrack(0, ONE_MINUTE, 4, True), ScheduledTrack(1, ONE_MINUTE, 3, False, is_audio=True)]
    )
    state = start("m", ONE_MINUTE.duration_us, 0)
    sent: list[tuple[int, int]] = []
    while (
        due := pacer.next_block(state, 500_000, SendPolicy(2, 1, prefetch=True))
    ) is not None and not due.is_prefetch:
        if not due.is_upgrade:
            sent.append((due.track, ONE_MINUTE.start_us(due.index)))
    sound = [at for track, at in sent if track == 1]
    assert SECOND_US <= min(sound) < 2 * SECOND_US
    for at in sound:
        before = [there for track, there in sent[: sent.index((1, at))] if track == 0]
        assert max(before) > min(at + CONSTRAINED_AUDIO_DELAY_US, 500_000 + URGENT_PREFETCH_US) - 2 * SECOND_US
