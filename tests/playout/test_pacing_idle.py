"""What is bettered over a line that has time for more: what stays on show, and a loop all of which is there."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.timing import Timing, even_blocks
from bunraku.playout.pacing import JUST, Due, Paced, Pacer
from bunraku.playout.timeline import start
from bunraku.wire.messages import TimelineState
from tests.playout.pacers import CAMERA, LONG, SECOND, TRACK, alone, beside


def troupe() -> Pacer:
    """Of two performers, the second in other blocks, sound, and a camera of three rates."""
    second, sound = even_blocks(24.0, 24 * 12, 1.3), even_blocks(30.0, 360)
    return Pacer(
        [
            *(Paced(0, TRACK, 5, True), Paced(1, second, 4, True)),
            *(Paced(2, sound, 3, False, audio=True), Paced(3, CAMERA, 3, False)),
        ]
    )


def idly(pacer: Pacer, state: TimelineState, clock: int, rate: int, idle: int, net: bool = False) -> list[Due]:
    sent = list(iter(lambda: pacer.next(state, clock, rate, 0, net=net, idle=idle), None))
    assert len(sent) < 200
    return sent


def on_show(pacer: Pacer, position: int) -> list[tuple[int, int]]:
    """Track and index of what is seen at a position before the last frames of the motion."""
    found = []
    for track in pacer.tracks:
        timing = track.timing
        index = timing.block_at(position)
        found.append((track.number, index))
        past = position - timing.start_us(index) > (timing.frames_in(index) - 1) * 1e6 / timing.fps
        if past and index + 1 < timing.blocks:
            found.append((track.number, index + 1))
    return [(number, index) for number, index in found if number != 2]


@given(st.integers(0, 11_900_000), st.integers(0, 4), st.integers(0, 4), st.booleans())
def test_while_the_stage_stands_what_is_on_show_is_bettered_once(
    position: int, rate: int, idle: int, net: bool
) -> None:
    state = start("m", TRACK.duration_us, 0, position=position, playing=False)
    pacer = troupe()
    sent = idly(pacer, state, 0, rate, idle, net)
    rates: dict[tuple[int, int], list[int]] = {}
    for due in sent:
        rates.setdefault((due.track, due.index), []).append(due.rate)
    assert all(told == sorted(set(told)) for told in rates.values())
    highest = {0: 4, 1: 3, 3: 2}
    for track, index in on_show(pacer, position):
        assert rates[track, index][-1] >= min(idle, highest[track])
    assert idly(pacer, state, 10_000_000, rate, idle, net) == []


def test_what_is_on_show_is_bettered_before_all_but_what_is_missing_near_it() -> None:
    for net in (False, True):
        state = start("m", 60 * SECOND, 0, position=20_200_000, playing=False)
        pacer = Pacer([Paced(0, LONG, 5, True), Paced(1, LONG, 5, True), Paced(2, even_blocks(60.0, 3600), 3, False)])
        sent = [(due.track, due.index, due.rate) for due in idly(pacer, state, 0, 1, 4, net)]
        first = sent.index((0, 20, 4))
        assert sent[first : first + 3] == [(0, 20, 4), (1, 20, 4), (2, 20, 2)]
        assert {(track, index) for track, index, _ in sent[:first]} == {(n, i) for n in (0, 1, 2) for i in (20, 21, 22)}
        assert {rate for _, index, rate in sent if index > 20} <= {0, 1}


def test_while_it_plays_what_is_on_show_stays_as_it_came_but_at_the_end() -> None:
    state = start("m", TRACK.duration_us, 0, loop=False)
    pacer = alone(5)
    before = [due for clock in range(0, 12 * SECOND, 100_000) for due in idly(pacer, state, clock, 1, 4)]
    assert {due.rate for due in before} == {0, 1}
    assert [(due.index, due.rate) for due in idly(pacer, state, 12 * SECOND, 1, 4)] == [(TRACK.blocks - 1, 4)]
    assert idly(pacer, state, 13 * SECOND, 1, 4) == []


def test_what_is_one_block_is_always_on_show() -> None:
    pacer = beside(Timing(60.0, 30, 30, 30))
    state = start("m", TRACK.duration_us, 0)
    sent = [due for clock in range(0, 24 * SECOND, 100_000) for due in idly(pacer, state, clock, 0, 3)]
    assert sorted((due.index, due.rate) for due in sent if due.track == 1) == [(0, 0), (0, 2)]
    assert {due.rate for due in sent if due.track == 0} == {0}


def test_without_room_or_before_the_net_is_there_nothing_on_show_is_bettered() -> None:
    state = start("m", TRACK.duration_us, 0, playing=False)
    for more in ({"spare": False}, {"better": False}):
        pacer = alone()
        drained = list(iter(lambda: pacer.next(state, 0, 0, net=True, idle=3, **more), None))  # noqa: B023
        assert {due.rate for due in drained} == {0}


@given(st.integers(0, 11_900_000), st.integers(0, 3), st.integers(0, 4))
def test_a_loop_all_of_which_was_sent_over_a_narrow_line_is_bettered_as_it_comes_around(
    position: int, rate: int, idle: int
) -> None:
    state = start("m", TRACK.duration_us, 0, position=position)
    pacer = troupe()
    sent: list[Due] = []
    for clock in range(0, 3 * TRACK.duration_us, 500_000):
        new = idly(pacer, state, clock, rate, idle, net=True)
        for due in new:
            if due.rate > rate:
                assert due.track != 2
                assert due.distance > JUST
                assert len({(one.track, one.index) for one in sent + new if one.track == 0}) == TRACK.blocks
        sent += new
    best: dict[tuple[int, int], int] = {}
    for due in sent:
        assert due.rate > best.get((due.track, due.index), -1)
        best[due.track, due.index] = due.rate
    for track, highest in ((0, 4), (1, 3), (3, 2)):
        told = {reached for (number, _), reached in best.items() if number == track}
        assert told == {max(min(idle, highest), min(rate, highest))}


def test_a_quick_line_gets_no_more_than_was_chosen_as_a_loop_comes_around() -> None:
    state = start("m", TRACK.duration_us, 0)
    pacer = troupe()
    sent = [due for clock in range(0, 3 * TRACK.duration_us, 500_000) for due in idly(pacer, state, clock, 1, 4)]
    assert {due.rate for due in sent} == {0, 1}
