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


def drain_all(scheduler: BlockScheduler, state: TimelineState, clock: int, level: int) -> list[ScheduledBlock]:
    sent = []
    while (due := scheduler.next_block(state, clock, SendPolicy(level))) is not None:
        sent.append(due)
        assert len(sent) < 100
    return sent


def drain(scheduler: BlockScheduler, state: TimelineState, clock: int, level: int) -> list[tuple[int, int]]:
    return [(due.index, due.level) for due in drain_all(scheduler, state, clock, level)]


def test_first_block_is_lowest_level_then_blocks_within_reach() -> None:
    state = start("m", TRACK.duration_us, 0)
    assert drain(motion_scheduler(), state, 0, 3) == [(0, 0), (1, 3), (2, 3), (3, 3), (4, 3)]


def test_only_first_block_is_sent_twice_in_two_loops() -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = motion_scheduler()
    sent = []
    for clock in range(0, 2 * TRACK.duration_us, 100_000):
        sent += drain(scheduler, state, clock, 3)
    assert sorted(sent) == sorted([(0, 0), *((i, 3) for i in range(TRACK.block_count))])


def test_sending_stops_at_end_and_follows_seek() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False, position=10 * SECOND_US)
    scheduler = motion_scheduler()
    assert [index for index, _ in drain(scheduler, state, 0, 2)] == [10, 11]
    assert drain(scheduler, edit(state, 0, position=5 * SECOND_US), 0, 2)[0] == (5, 0)


@given(st.integers(0, 40 * SECOND_US), st.integers(-3, 9))
def test_visible_block_is_sent_first(clock: int, level: int) -> None:
    state = start("m", TRACK.duration_us, 0)
    due = motion_scheduler().next_block(state, clock, SendPolicy(level))
    assert due is not None
    assert due.index == TRACK.block_at(clock % TRACK.duration_us)


def test_time_until_next_ends_when_block_comes_within_reach() -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = motion_scheduler()
    drain(scheduler, state, 0, 3)
    wait = scheduler.time_until_next(state, 0)
    assert wait is not None
    assert drain(scheduler, state, wait - 2_000, 3) == []
    assert drain(scheduler, state, wait, 3) == [(SEND_AHEAD_US // SECOND_US + 1, 3)]
    assert scheduler.time_until_next(edit(state, 0, playing=False), 0) is None


def test_track_without_levels_is_rejected() -> None:
    with pytest.raises(ValueError, match="rate"):
        motion_scheduler(0)


def test_order_is_base_motion_camera_light_upgrades() -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = motion_and_scene_scheduler(CAMERA, CAMERA)
    sent = [(due.track, due.index, due.level) for due in drain_all(scheduler, state, 0, 0)]
    assert sent == [(track, index, 0) for index in range(5) for track in range(3)]
    better = [(due.track, due.index, due.level, due.is_upgrade) for due in drain_all(scheduler, state, 0, 3)]
    assert better == [(track, index, 3 if track == 0 else 2, True) for index in range(1, 5) for track in range(3)]
    # missing blocks precede upgrades
    scheduler = motion_and_scene_scheduler(CAMERA)
    drain_all(scheduler, state, 0, 0)
    later_blocks = drain_all(scheduler, state, SECOND_US, 3)
    assert [(due.track, due.index) for due in later_blocks[:2]] == [(0, 5), (1, 5)]
    assert all(due.is_upgrade for due in later_blocks[2:])


def motion_and_audio_scheduler(*timings: Timing) -> BlockScheduler:
    """Return a scheduler of a motion, audio_level, and cameras or lights."""
    tracks = [ScheduledTrack(0, TRACK, 4, True), ScheduledTrack(1, plan_timing(30.0, 360), 3, False, is_audio=True)]
    return BlockScheduler(
        [*tracks, *(ScheduledTrack(number, timing, 3, False) for number, timing in enumerate(timings, 2))]
    )


def drain_levels(
    scheduler: BlockScheduler, state: TimelineState, level: int, audio_level: int | None
) -> list[tuple[int, int, int]]:
    sent = []
    while (due := scheduler.next_block(state, 0, SendPolicy(level, audio_level))) is not None:
        sent.append((due.track, due.index, due.level))
        assert len(sent) < 100
    return sent


def test_order_at_one_instant_is_motion_audio_scenes() -> None:
    state = start("m", TRACK.duration_us, 0)
    sent = drain_levels(motion_and_audio_scheduler(CAMERA), state, 3, 1)
    assert sent[:3] == [(0, 0, 0), (1, 0, 0), (2, 0, 2)]
    assert sent[3:] == [(track, index, level) for index in range(1, 5) for track, level in ((0, 3), (1, 1), (2, 2))]


def test_audio_is_upgraded_when_within_reach_again_in_loop() -> None:
    for seconds in (2.0, 4.5, 5.5, 12.0):
        timing = plan_timing(30.0, round(30 * seconds))
        state = start("m", timing.duration_us, 0)
        scheduler = BlockScheduler(
            [ScheduledTrack(0, timing, 1, True), ScheduledTrack(1, timing, 3, False, is_audio=True)]
        )
        sent = []
        for clock in range(0, 3 * timing.duration_us, 100_000):
            while (
                due := scheduler.next_block(state, clock, SendPolicy(0, 0 if clock < timing.duration_us else 2))
            ) is not None:
                sent.append((due.track, due.index, due.level))
        audio_blocks = [(index, level) for track, index, level in sent if track == 1]
        assert sorted(audio_blocks) == [(index, level) for index in range(timing.block_count) for level in (0, 2)]


def test_audio_has_separate_level_and_may_be_omitted() -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = motion_and_audio_scheduler()
    assert {track for track, _, _ in drain_levels(scheduler, state, 1, -1)} == {0}
    # omitted audio_level is missing, and precedes upgrades
    later_blocks = drain_levels(scheduler, state, 3, 0)
    assert later_blocks == [*((1, index, 0) for index in range(5)), *((0, index, 3) for index in range(1, 5))]
    # audio_level is upgraded far ahead only, not where it is buffered already
    assert drain_levels(scheduler, state, 3, 2) == [(1, 4, 2)]
    assert {level for track, _, level in drain_levels(motion_and_audio_scheduler(), state, 1, None) if track == 1} == {
        0,
        1,
    }


def test_camera_may_be_sent_alone() -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = BlockScheduler([ScheduledTrack(1, CAMERA, 3, False)])
    assert [(due.track, due.index, due.level) for due in drain_all(scheduler, state, 0, 3)] == [
        (1, i, 2) for i in range(5)
    ]
    assert BlockScheduler([]).next_block(state, 0, SendPolicy(3)) is None
    assert BlockScheduler([]).time_until_next(state, 0) is None


@given(
    st.integers(1, 1500),
    st.sampled_from([24.0, 30.0, 59.94]),
    st.integers(0, 11_999_999),
    st.integers(0, 3),
    st.booleans(),
)
def test_scene_of_any_length_is_sent_once_and_in_time(
    frames: int, fps: float, position: int, level: int, loop: bool
) -> None:
    timing = plan_timing(fps, frames)
    state = start("m", TRACK.duration_us, 0, position=position, loop=loop)
    scheduler = BlockScheduler([ScheduledTrack(1, timing, 4, False)])
    sent: list[int] = []
    clock = 0
    while clock < 2 * TRACK.duration_us:
        sent += [due.index for due in drain_all(scheduler, state, clock, level)]
        where = position + clock
        on_show = min(where, TRACK.duration_us) if not loop else where % TRACK.duration_us
        assert timing.block_at(min(on_show, TRACK.duration_us - 1)) in sent
        wait = scheduler.time_until_next(state, clock)
        assert wait is not None
        assert wait > 0
        clock += wait
    shown = timing.block_at(TRACK.duration_us - 1) + 1
    assert sorted(sent) == list(range(0 if loop else timing.block_at(position), shown))


@given(st.integers(0, 11_999_999), st.integers(0, 3), st.integers(0, 3))
def test_upgrades_have_higher_level_and_sufficient_lead(position: int, before: int, level: int) -> None:
    state = start("m", TRACK.duration_us, 0, position=position)
    scheduler = motion_and_scene_scheduler(CAMERA)
    sent_levels = {(due.track, due.index): due.level for due in drain_all(scheduler, state, 0, before)}
    for due in drain_all(scheduler, state, 0, level):
        assert due.is_upgrade
        assert due.lead_us > MIN_UPGRADE_LEAD_US
        assert due.level > sent_levels[due.track, due.index]


def test_prefetch_precedes_later_upgrades_and_is_refilled_at_once() -> None:
    state = start("m", 60 * SECOND_US, 0)
    scheduler = BlockScheduler([ScheduledTrack(0, ONE_MINUTE, 5, True)])
    sent = []
    while (due := scheduler.next_block(state, 0, SendPolicy(4, prefetch=True))) is not None:
        sent.append((due.index, due.level))
    prefetched = [index for index, level in sent if level == 0]
    assert prefetched == sorted(prefetched)
    assert ONE_MINUTE.start_us(max(prefetched)) <= MAX_PREFETCH_US < ONE_MINUTE.start_us(max(prefetched) + 1)
    last = sent.index((max(prefetched), 0))
    upgraded = [ONE_MINUTE.start_us(index) for index, level in sent[:last] if level == 4]
    assert max(upgraded) <= UPGRADE_FIRST_US
    first = sent.index((0, 4)) if (0, 4) in sent else sent.index((1, 4))
    assert max(ONE_MINUTE.start_us(index) for index, _ in sent[:first]) > MIN_PREFETCH_US - 2 * SECOND_US
    assert max(ONE_MINUTE.start_us(index) for index, level in sent if level == 4) <= UPGRADE_AHEAD_US
    # the prefetch is refilled only when it reaches less far than PREFETCH_REFILL_US
    refills = []
    for clock in range(0, 25 * SECOND_US, SECOND_US):
        lowest_count = 0
        while (due := scheduler.next_block(state, clock, SendPolicy(4, prefetch=True))) is not None:
            lowest_count += due.level == 0
        if lowest_count:
            refills.append(lowest_count)
    assert min(refills) >= 9
    assert len(refills) <= 3


@given(st.integers(0, 59 * SECOND_US), st.integers(1, 4))
def test_only_prefetch_is_sent_without_upgrades(position: int, level: int) -> None:
    state = start("m", 60 * SECOND_US, 0, position=position)
    scheduler = BlockScheduler([ScheduledTrack(0, ONE_MINUTE, 5, True)])
    sent = list(
        iter(lambda: scheduler.next_block(state, 0, SendPolicy(level, prefetch=True, allow_upgrades=False)), None)
    )
    assert {due.level for due in sent} == {0}
    assert len({due.index for due in sent}) == len(sent) >= MAX_PREFETCH_US // SECOND_US
    better = list(iter(lambda: scheduler.next_block(state, 0, SendPolicy(level, prefetch=True)), None))
    assert better
    assert all(due.is_upgrade and due.level == level for due in better)


@given(st.integers(0, 59 * SECOND_US), st.integers(1, 4))
def test_without_spare_capacity_only_urgent_blocks_are_sent(position: int, level: int) -> None:
    state = start("m", 60 * SECOND_US, 0, position=position)
    scheduler = BlockScheduler([ScheduledTrack(0, ONE_MINUTE, 5, True)])
    while (
        due := scheduler.next_block(state, 0, SendPolicy(level, prefetch=True, has_spare_capacity=False))
    ) is not None:
        assert not due.is_upgrade
        assert due.lead_us <= URGENT_PREFETCH_US
        assert due.level == 0


@given(st.lists(st.integers(-1, 4), min_size=5, max_size=5), st.booleans())
def test_marked_blocks_are_not_sent_again(levels: list[int], prefetched: bool) -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = BlockScheduler([ScheduledTrack(0, TRACK, 5, True)])
    for index, level in enumerate(levels):
        if level >= 0:
            scheduler.mark_sent(0, index, level)
    while (due := scheduler.next_block(state, 0, SendPolicy(3, prefetch=prefetched))) is not None:
        assert due.index >= len(levels) or due.level > levels[due.index]


def blocks_by_replay(
    tracks: list[ScheduledTrack], state: TimelineState, clock: int, level: int, audio_level: int | None
) -> list[tuple[int, int, int]]:
    """Return the blocks within reach at `clock`, after sending all earlier ones one by one."""
    scheduler = BlockScheduler(tracks)
    while scheduler.next_block(state, clock - 2 * SCHEDULING_MARGIN_US, SendPolicy(level, audio_level)) is not None:
        pass
    found = []
    while (due := scheduler.next_block(state, clock, SendPolicy(level, audio_level))) is not None:
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
def test_newly_due_blocks_equal_replay(
    shapes: list[tuple[float, int, int]], begin: int, loop: bool, level: int, audio_level: int | None
) -> None:
    timings = [Timing(fps, frames, min(block, frames), min(block // 2, frames)) for fps, frames, block in shapes]
    tracks = [ScheduledTrack(n, timing, 3, n == 0, n == 1) for n, timing in enumerate(timings)]
    state = TimelineState(1, "one", 0, 0, True, loop, timings[0].duration_us)
    clock = begin + (BlockScheduler(tracks).time_until_next(state, begin) or 0)
    newly_due = [
        (due.track, due.index, due.level)
        for due in newly_due_blocks(tracks, state, clock, SendPolicy(level, audio_level))
    ]
    assert newly_due == blocks_by_replay(tracks, state, clock, level, audio_level)


def test_constrained_link_sends_motion_before_audio_and_drops_late_audio() -> None:
    scheduler = BlockScheduler(
        [ScheduledTrack(0, ONE_MINUTE, 4, True), ScheduledTrack(1, ONE_MINUTE, 3, False, is_audio=True)]
    )
    state = start("m", ONE_MINUTE.duration_us, 0)
    sent: list[tuple[int, int]] = []
    while (
        due := scheduler.next_block(state, 500_000, SendPolicy(2, 1, prefetch=True))
    ) is not None and not due.is_prefetch:
        if not due.is_upgrade:
            sent.append((due.track, ONE_MINUTE.start_us(due.index)))
    audio_blocks = [at for track, at in sent if track == 1]
    assert SECOND_US <= min(audio_blocks) < 2 * SECOND_US
    for at in audio_blocks:
        before = [there for track, there in sent[: sent.index((1, at))] if track == 0]
        assert max(before) > min(at + CONSTRAINED_AUDIO_DELAY_US, 500_000 + URGENT_PREFETCH_US) - 2 * SECOND_US
