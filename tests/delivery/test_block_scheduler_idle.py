"""Upgrades while the link is idle_level: of visible blocks, and of a loop that was sent completely."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.timing import Timing, plan_timing
from bunraku.delivery.block_scheduler import (
    UPGRADE_FIRST_US,
    BlockScheduler,
    ScheduledBlock,
    ScheduledTrack,
    SendPolicy,
)
from bunraku.playout.timeline import start
from bunraku.wire.messages import TimelineState
from tests.delivery.schedulers import CAMERA, ONE_MINUTE, SECOND_US, TRACK, motion_and_scene_scheduler, motion_scheduler


def performers_scheduler() -> BlockScheduler:
    """Return a scheduler of two performers with different blocks, audio, and a camera with three levels."""
    second, audio = plan_timing(24.0, 24 * 12, 1.3), plan_timing(30.0, 360)
    return BlockScheduler(
        [
            *(ScheduledTrack(0, TRACK, 5, True), ScheduledTrack(1, second, 4, True)),
            *(ScheduledTrack(2, audio, 3, False, is_audio=True), ScheduledTrack(3, CAMERA, 3, False)),
        ]
    )


def drain_idle(
    scheduler: BlockScheduler, state: TimelineState, clock: int, level: int, idle_level: int, prefetch: bool = False
) -> list[ScheduledBlock]:
    sent = list(
        iter(
            lambda: scheduler.next_block(state, clock, SendPolicy(level, 0, prefetch=prefetch, idle_level=idle_level)),
            None,
        )
    )
    assert len(sent) < 200
    return sent


def visible_blocks(scheduler: BlockScheduler, position: int) -> list[tuple[int, int]]:
    """Return track and index of the visible blocks at a position before the last frames of the motion."""
    found = []
    for track in scheduler.tracks:
        timing = track.timing
        index = timing.block_at(position)
        found.append((track.index, index))
        past = position - timing.start_us(index) > (timing.frames_in(index) - 1) * 1e6 / timing.fps
        if past and index + 1 < timing.block_count:
            found.append((track.index, index + 1))
    return [(number, index) for number, index in found if number != 2]


@given(st.integers(0, 11_900_000), st.integers(0, 4), st.integers(0, 4), st.booleans())
def test_paused_stage_upgrades_visible_blocks_once(position: int, level: int, idle_level: int, prefetch: bool) -> None:
    state = start("m", TRACK.duration_us, 0, position=position, playing=False)
    scheduler = performers_scheduler()
    sent = drain_idle(scheduler, state, 0, level, idle_level, prefetch)
    levels: dict[tuple[int, int], list[int]] = {}
    for due in sent:
        levels.setdefault((due.track, due.index), []).append(due.level)
    assert all(sent_levels == sorted(set(sent_levels)) for sent_levels in levels.values())
    highest = {0: 4, 1: 3, 3: 2}
    for track, index in visible_blocks(scheduler, position):
        assert levels[track, index][-1] >= min(idle_level, highest[track])
    assert drain_idle(scheduler, state, 10_000_000, level, idle_level, prefetch) == []


def test_visible_upgrades_follow_urgent_blocks_only() -> None:
    for prefetch in (False, True):
        state = start("m", 60 * SECOND_US, 0, position=20_200_000, playing=False)
        scheduler = BlockScheduler(
            [
                ScheduledTrack(0, ONE_MINUTE, 5, True),
                ScheduledTrack(1, ONE_MINUTE, 5, True),
                ScheduledTrack(2, plan_timing(60.0, 3600), 3, False),
            ]
        )
        sent = [(due.track, due.index, due.level) for due in drain_idle(scheduler, state, 0, 1, 4, prefetch)]
        first = sent.index((0, 20, 4))
        assert sent[first : first + 3] == [(0, 20, 4), (1, 20, 4), (2, 20, 2)]
        assert {(track, index) for track, index, _ in sent[:first]} == {(n, i) for n in (0, 1, 2) for i in (20, 21, 22)}
        assert {level for _, index, level in sent if index > 20} <= {0, 1}


def test_playing_stage_has_no_visible_upgrade_before_end() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False)
    scheduler = motion_scheduler(5)
    before = [due for clock in range(0, 12 * SECOND_US, 100_000) for due in drain_idle(scheduler, state, clock, 1, 4)]
    assert {due.level for due in before} == {0, 1}
    assert [(due.index, due.level) for due in drain_idle(scheduler, state, 12 * SECOND_US, 1, 4)] == [
        (TRACK.block_count - 1, 4)
    ]
    assert drain_idle(scheduler, state, 13 * SECOND_US, 1, 4) == []


def test_one_block_track_is_always_upgraded() -> None:
    scheduler = motion_and_scene_scheduler(Timing(60.0, 30, 30, 30))
    state = start("m", TRACK.duration_us, 0)
    sent = [due for clock in range(0, 24 * SECOND_US, 100_000) for due in drain_idle(scheduler, state, clock, 0, 3)]
    assert sorted((due.index, due.level) for due in sent if due.track == 1) == [(0, 0), (0, 2)]
    assert {due.level for due in sent if due.track == 0} == {0}


def test_no_visible_upgrade_without_capacity_or_before_prefetch() -> None:
    state = start("m", TRACK.duration_us, 0, playing=False)
    blocked = SendPolicy(0, prefetch=True, idle_level=3)
    for policy in (blocked._replace(has_spare_capacity=False), blocked._replace(allow_upgrades=False)):
        scheduler = motion_scheduler()
        drained = list(iter(lambda: scheduler.next_block(state, 0, policy), None))  # noqa: B023
        assert {due.level for due in drained} == {0}


@given(st.integers(0, 11_900_000), st.integers(0, 3), st.integers(0, 4))
def test_complete_loop_is_upgraded_on_constrained_link(position: int, level: int, idle_level: int) -> None:
    state = start("m", TRACK.duration_us, 0, position=position)
    scheduler = performers_scheduler()
    sent: list[ScheduledBlock] = []
    for clock in range(0, 3 * TRACK.duration_us, 500_000):
        new = drain_idle(scheduler, state, clock, level, idle_level, prefetch=True)
        for due in new:
            if due.level > level:
                assert due.track != 2
                assert due.lead_us > UPGRADE_FIRST_US
                assert len({(one.track, one.index) for one in sent + new if one.track == 0}) == TRACK.block_count
        sent += new
    best: dict[tuple[int, int], int] = {}
    for due in sent:
        assert due.level > best.get((due.track, due.index), -1)
        best[due.track, due.index] = due.level
    for track, highest in ((0, 4), (1, 3), (3, 2)):
        sent_levels = {reached for (number, _), reached in best.items() if number == track}
        assert sent_levels == {max(min(idle_level, highest), min(level, highest))}


def test_loop_is_not_upgraded_on_unconstrained_link() -> None:
    state = start("m", TRACK.duration_us, 0)
    scheduler = performers_scheduler()
    sent = [
        due for clock in range(0, 3 * TRACK.duration_us, 500_000) for due in drain_idle(scheduler, state, clock, 1, 4)
    ]
    assert {due.level for due in sent} == {0, 1}
