"""What is bettered over a line that has time for more: what stays on show, and a loop all of which is there."""

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


def troupe() -> BlockScheduler:
    """Of two performers, the second in other blocks, sound, and a camera of three rates."""
    second, sound = plan_timing(24.0, 24 * 12, 1.3), plan_timing(30.0, 360)
    return BlockScheduler(
        [
            *(ScheduledTrack(0, TRACK, 5, True), ScheduledTrack(1, second, 4, True)),
            *(ScheduledTrack(2, sound, 3, False, is_audio=True), ScheduledTrack(3, CAMERA, 3, False)),
        ]
    )


def drain_idle(
    pacer: BlockScheduler, state: TimelineState, clock: int, rate: int, idle: int, net: bool = False
) -> list[ScheduledBlock]:
    sent = list(iter(lambda: pacer.next_block(state, clock, SendPolicy(rate, 0, prefetch=net, idle_level=idle)), None))
    assert len(sent) < 200
    return sent


def visible_blocks(pacer: BlockScheduler, position: int) -> list[tuple[int, int]]:
    """Track and index of what is seen at a position before the last frames of the motion."""
    found = []
    for track in pacer.tracks:
        timing = track.timing
        index = timing.block_at(position)
        found.append((track.index, index))
        past = position - timing.start_us(index) > (timing.frames_in(index) - 1) * 1e6 / timing.fps
        if past and index + 1 < timing.block_count:
            found.append((track.index, index + 1))
    return [(number, index) for number, index in found if number != 2]


@given(st.integers(0, 11_900_000), st.integers(0, 4), st.integers(0, 4), st.booleans())
def test_while_the_stage_stands_what_is_on_show_is_bettered_once(
    position: int, rate: int, idle: int, net: bool
) -> None:
    state = start("m", TRACK.duration_us, 0, position=position, playing=False)
    pacer = troupe()
    sent = drain_idle(pacer, state, 0, rate, idle, net)
    rates: dict[tuple[int, int], list[int]] = {}
    for due in sent:
        rates.setdefault((due.track, due.index), []).append(due.level)
    assert all(told == sorted(set(told)) for told in rates.values())
    highest = {0: 4, 1: 3, 3: 2}
    for track, index in visible_blocks(pacer, position):
        assert rates[track, index][-1] >= min(idle, highest[track])
    assert drain_idle(pacer, state, 10_000_000, rate, idle, net) == []


def test_what_is_on_show_is_bettered_before_all_but_what_is_missing_near_it() -> None:
    for net in (False, True):
        state = start("m", 60 * SECOND_US, 0, position=20_200_000, playing=False)
        pacer = BlockScheduler(
            [
                ScheduledTrack(0, ONE_MINUTE, 5, True),
                ScheduledTrack(1, ONE_MINUTE, 5, True),
                ScheduledTrack(2, plan_timing(60.0, 3600), 3, False),
            ]
        )
        sent = [(due.track, due.index, due.level) for due in drain_idle(pacer, state, 0, 1, 4, net)]
        first = sent.index((0, 20, 4))
        assert sent[first : first + 3] == [(0, 20, 4), (1, 20, 4), (2, 20, 2)]
        assert {(track, index) for track, index, _ in sent[:first]} == {(n, i) for n in (0, 1, 2) for i in (20, 21, 22)}
        assert {rate for _, index, rate in sent if index > 20} <= {0, 1}


def test_while_it_plays_what_is_on_show_stays_as_it_came_but_at_the_end() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False)
    pacer = motion_scheduler(5)
    before = [due for clock in range(0, 12 * SECOND_US, 100_000) for due in drain_idle(pacer, state, clock, 1, 4)]
    assert {due.level for due in before} == {0, 1}
    assert [(due.index, due.level) for due in drain_idle(pacer, state, 12 * SECOND_US, 1, 4)] == [
        (TRACK.block_count - 1, 4)
    ]
    assert drain_idle(pacer, state, 13 * SECOND_US, 1, 4) == []


def test_what_is_one_block_is_always_on_show() -> None:
    pacer = motion_and_scene_scheduler(Timing(60.0, 30, 30, 30))
    state = start("m", TRACK.duration_us, 0)
    sent = [due for clock in range(0, 24 * SECOND_US, 100_000) for due in drain_idle(pacer, state, clock, 0, 3)]
    assert sorted((due.index, due.level) for due in sent if due.track == 1) == [(0, 0), (0, 2)]
    assert {due.level for due in sent if due.track == 0} == {0}


def test_without_room_or_before_the_net_is_there_nothing_on_show_is_bettered() -> None:
    state = start("m", TRACK.duration_us, 0, playing=False)
    blocked = SendPolicy(0, prefetch=True, idle_level=3)
    for policy in (blocked._replace(has_spare_capacity=False), blocked._replace(allow_upgrades=False)):
        pacer = motion_scheduler()
        drained = list(iter(lambda: pacer.next_block(state, 0, policy), None))  # noqa: B023
        assert {due.level for due in drained} == {0}


@given(st.integers(0, 11_900_000), st.integers(0, 3), st.integers(0, 4))
def test_a_loop_all_of_which_was_sent_over_a_narrow_line_is_bettered_as_it_comes_around(
    position: int, rate: int, idle: int
) -> None:
    state = start("m", TRACK.duration_us, 0, position=position)
    pacer = troupe()
    sent: list[ScheduledBlock] = []
    for clock in range(0, 3 * TRACK.duration_us, 500_000):
        new = drain_idle(pacer, state, clock, rate, idle, net=True)
        for due in new:
            if due.level > rate:
                assert due.track != 2
                assert due.lead_us > UPGRADE_FIRST_US
                assert len({(one.track, one.index) for one in sent + new if one.track == 0}) == TRACK.block_count
        sent += new
    best: dict[tuple[int, int], int] = {}
    for due in sent:
        assert due.level > best.get((due.track, due.index), -1)
        best[due.track, due.index] = due.level
    for track, highest in ((0, 4), (1, 3), (3, 2)):
        told = {reached for (number, _), reached in best.items() if number == track}
        assert told == {max(min(idle, highest), min(rate, highest))}


def test_a_quick_line_gets_no_more_than_was_chosen_as_a_loop_comes_around() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = troupe()
    sent = [due for clock in range(0, 3 * TRACK.duration_us, 500_000) for due in drain_idle(pacer, state, clock, 1, 4)]
    assert {due.level for due in sent} == {0, 1}
