from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.playout.window import HEADS, LEAST, PACKET, Window, on_line
from tests.playout.virtual_line import VirtualLine

SECOND = 1_000_000
OVERLAY = 88
"""Bytes of an overlay of four limbs, in its frame."""
EVERY = 33_333


@dataclass
class Run:
    """What came of a run: when each overlay was written, and how long after it was made it arrived (µs)."""

    line: VirtualLine
    window: Window
    late: list[tuple[int, float]] = field(default_factory=list)

    def between(self, begin: float, end: float) -> list[float]:
        """Milliseconds of those written between two seconds."""
        return sorted(late / 1e3 for at, late in self.late if begin * SECOND <= at < end * SECOND)


def run(rate_at: Callable[[int], float], delay: int, seconds: float, block: int = 0) -> Run:
    """The newest overlay as often as there is room for it, and a block a second if `block` has a size."""
    line, window = VirtualLine(rate_at, delay), Window()
    # as the system saw it when the connection was made
    least = 2 * delay + round(120e6 / rate_at(0))
    outcome = Run(line, window)
    made: int | None = None
    overlay_at, block_at, at, waits = EVERY, SECOND, 0, False
    while at < seconds * SECOND:
        if at >= overlay_at:
            made, overlay_at = overlay_at, overlay_at + EVERY
        if block and at >= block_at:
            waits, block_at = True, block_at + SECOND
        if window.flying:
            window.acknowledged(at, line.waiting(at), least)
        if (made is not None or waits) and window.room(at):
            size = block if waits else OVERLAY
            arrives = line.write(at, size)
            window.wrote(at, size)
            if waits:
                waits = False
            else:
                assert made is not None
                outcome.late.append((at, arrives - made))
                made = None
            continue
        at = min(at + window.wait(), overlay_at) if made is not None or waits or window.flying else overlay_at
    return outcome


@settings(max_examples=30)
@given(st.integers(1_500, 5_000), st.integers(20_000, 150_000))
def test_on_a_narrow_line_the_newest_comes_soon_and_the_line_is_used(rate: int, delay: int) -> None:
    ran = run(lambda _: float(rate), delay, 30.0)
    late = ran.between(10, 30)
    transmission = on_line(OVERLAY) / rate * 1e3
    # a period until there is room, the queue, one's own way
    assert late[len(late) // 2] < delay / 1e3 + 4 * transmission + 120
    assert late[-1] < delay / 1e3 + 6 * transmission + 250
    offered = on_line(OVERLAY) * SECOND / EVERY
    assert len(late) * on_line(OVERLAY) / 20.0 > 0.8 * min(rate, offered)
    assert ran.window.rate == pytest.approx(min(rate, offered), rel=0.35)


def test_on_a_quick_line_nothing_waits() -> None:
    ran = run(lambda _: 1e6, 20_000, 20.0, block=800)
    assert max(ran.between(1, 20)) < 25 + EVERY / 1e3
    assert len(ran.between(0, 20)) >= 595
    assert not ran.window.narrow(20 * SECOND)


def test_a_block_among_overlays_costs_its_own_time_and_no_more() -> None:
    ran = run(lambda _: 3_600.0, 75_000, 40.0, block=600)
    late = ran.between(10, 40)
    assert late[int(0.95 * len(late))] < 400
    assert ran.line.carried > 0.85 * 3_600 * 40


def test_a_line_that_becomes_slower_and_quick_again_is_followed() -> None:
    ran = run(lambda at: 1_800.0 if 10 * SECOND <= at < 20 * SECOND else 7_000.0, 75_000, 32.0)
    assert max(ran.between(5, 10)) < 250
    assert max(ran.between(12, 20)) < 450
    assert len(ran.between(24, 32)) > 0.9 * 8 * 30
    assert ran.window.narrow(20 * SECOND)


@given(st.lists(st.tuples(st.integers(0, 300_000), st.integers(0, 3_000), st.integers(0, 9_000)), max_size=60))
def test_whatever_is_said_there_is_room_again_once_all_is_acknowledged(
    events: list[tuple[int, int, int]],
) -> None:
    window, at = Window(), 0
    for passed, size, waiting in events:
        at += passed
        if size:
            window.wrote(at, size)
        window.acknowledged(at, waiting)
        assert window.flying >= 0
        assert window.limit > 0
        assert window.wait() > 0
        assert window.room(at) or window.flying
    window.acknowledged(at + 1, 0)
    assert window.flying == 0
    assert window.room(at + 1)


def test_before_anything_is_known_a_first_flight_may_go() -> None:
    window = Window()
    written = 0
    while window.room(0):
        window.wrote(0, 100)
        written += 100 + HEADS
    assert LEAST <= written < LEAST + 200
    assert window.rate is None


def test_messages_pay_for_the_heads_of_each_of_their_packets() -> None:
    assert on_line(1) == 1 + HEADS
    assert on_line(PACKET) == PACKET + HEADS
    assert on_line(PACKET + 1) == PACKET + 1 + 2 * HEADS


def test_what_nobody_looked_out_for_says_nothing() -> None:
    window = Window()
    window.wrote(0, 100)
    window.acknowledged(5 * SECOND, 0)
    assert window.rate is None
    assert not window.narrow(5 * SECOND)


def test_what_has_come_is_told_by_its_bytes() -> None:
    window = Window()
    assert window.came(0)
    for _ in range(3):
        window.wrote(0, 100)
    assert [window.came(written) for written in (0, 99, 100)] == [True, True, False]
    window.acknowledged(50_000, 150)
    assert [window.came(written) for written in (100, 199, 200)] == [True, True, False]
    window.acknowledged(60_000, 0)
    assert window.came(300)


def test_what_was_written_besides_is_waited_for_but_not_counted() -> None:
    window = Window()
    window.wrote(0, 1_000)
    window.passed(500)
    assert window.written == 1_500
    assert window.flying == on_line(1_000)
    # the system knows of both: the first is acknowledged when only what came after it is waiting
    window.acknowledged(50_000, 501)
    assert window.flying > 0
    window.acknowledged(60_000, 500)
    assert window.flying == 0
    assert window.room(60_000)
