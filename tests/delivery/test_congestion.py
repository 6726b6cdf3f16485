from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.delivery.congestion import (
    HEADER_BYTES,
    INITIAL_WINDOW_BYTES,
    MAX_SEGMENT_BYTES,
    CongestionWindow,
    bytes_on_wire,
)
from tests.delivery.virtual_link import VirtualLink

SECOND = 1_000_000
OVERLAY_BYTES = 88
"""Bytes of an overlay of four limbs, in its frame."""
OVERLAY_INTERVAL_US = 33_333


@dataclass
class SimulationResult:
    """What came of a run: when each overlay was written, and how long after it was made it arrived (µs)."""

    link: VirtualLink
    window: CongestionWindow
    overlay_delays: list[tuple[int, float]] = field(default_factory=list)

    def delays_between(self, begin: float, end: float) -> list[float]:
        """Milliseconds of those written between two seconds."""
        return sorted(late / 1e3 for at, late in self.overlay_delays if begin * SECOND <= at < end * SECOND)


def simulate(rate_at: Callable[[int], float], delay: int, seconds: float, block: int = 0) -> SimulationResult:
    """The newest overlay as often as there is room for it, and a block a second if `block` has a size."""
    line, window = VirtualLink(rate_at, delay), CongestionWindow()
    # as the system saw it when the connection was made
    least = 2 * delay + round(120e6 / rate_at(0))
    outcome = SimulationResult(line, window)
    made: int | None = None
    overlay_at, block_at, at, waits = OVERLAY_INTERVAL_US, SECOND, 0, False
    while at < seconds * SECOND:
        if at >= overlay_at:
            made, overlay_at = overlay_at, overlay_at + OVERLAY_INTERVAL_US
        if block and at >= block_at:
            waits, block_at = True, block_at + SECOND
        if window.in_flight_bytes:
            window.record_ack(at, line.unacked_bytes(at), least)
        if (made is not None or waits) and window.has_capacity(at):
            size = block if waits else OVERLAY_BYTES
            arrives = line.write(at, size)
            window.record_write(at, size)
            if waits:
                waits = False
            else:
                assert made is not None
                outcome.overlay_delays.append((at, arrives - made))
                made = None
            continue
        at = (
            min(at + window.retry_delay(), overlay_at)
            if made is not None or waits or window.in_flight_bytes
            else overlay_at
        )
    return outcome


@settings(max_examples=30)
@given(st.integers(1_500, 5_000), st.integers(20_000, 150_000))
def test_on_a_narrow_line_the_newest_comes_soon_and_the_line_is_used(rate: int, delay: int) -> None:
    ran = simulate(lambda _: float(rate), delay, 30.0)
    late = ran.delays_between(10, 30)
    transmission = bytes_on_wire(OVERLAY_BYTES) / rate * 1e3
    # a period until there is room, the queue, one's own way
    assert late[len(late) // 2] < delay / 1e3 + 4 * transmission + 120
    assert late[-1] < delay / 1e3 + 6 * transmission + 250
    offered = bytes_on_wire(OVERLAY_BYTES) * SECOND / OVERLAY_INTERVAL_US
    assert len(late) * bytes_on_wire(OVERLAY_BYTES) / 20.0 > 0.8 * min(rate, offered)
    assert ran.window.throughput == pytest.approx(min(rate, offered), rel=0.35)


def test_on_a_quick_line_nothing_waits() -> None:
    ran = simulate(lambda _: 1e6, 20_000, 20.0, block=800)
    assert max(ran.delays_between(1, 20)) < 25 + OVERLAY_INTERVAL_US / 1e3
    assert len(ran.delays_between(0, 20)) >= 595
    assert not ran.window.is_constrained(20 * SECOND)


def test_a_block_among_overlays_costs_its_own_time_and_no_more() -> None:
    ran = simulate(lambda _: 3_600.0, 75_000, 40.0, block=600)
    late = ran.delays_between(10, 40)
    assert late[int(0.95 * len(late))] < 400
    assert ran.link.sent_bytes > 0.85 * 3_600 * 40


def test_a_line_that_becomes_slower_and_quick_again_is_followed() -> None:
    ran = simulate(lambda at: 1_800.0 if 10 * SECOND <= at < 20 * SECOND else 7_000.0, 75_000, 32.0)
    assert max(ran.delays_between(5, 10)) < 250
    assert max(ran.delays_between(12, 20)) < 450
    assert len(ran.delays_between(24, 32)) > 0.9 * 8 * 30
    assert ran.window.is_constrained(20 * SECOND)


@given(st.lists(st.tuples(st.integers(0, 300_000), st.integers(0, 3_000), st.integers(0, 9_000)), max_size=60))
def test_whatever_is_said_there_is_room_again_once_all_is_acknowledged(
    events: list[tuple[int, int, int]],
) -> None:
    window, at = CongestionWindow(), 0
    for passed, size, waiting in events:
        at += passed
        if size:
            window.record_write(at, size)
        window.record_ack(at, waiting)
        assert window.in_flight_bytes >= 0
        assert window.limit_bytes > 0
        assert window.retry_delay() > 0
        assert window.has_capacity(at) or window.in_flight_bytes
    window.record_ack(at + 1, 0)
    assert window.in_flight_bytes == 0
    assert window.has_capacity(at + 1)


def test_before_anything_is_known_a_first_flight_may_go() -> None:
    window = CongestionWindow()
    written = 0
    while window.has_capacity(0):
        window.record_write(0, 100)
        written += 100 + HEADER_BYTES
    assert INITIAL_WINDOW_BYTES <= written < INITIAL_WINDOW_BYTES + 200
    assert window.throughput is None


def test_messages_pay_for_the_heads_of_each_of_their_packets() -> None:
    assert bytes_on_wire(1) == 1 + HEADER_BYTES
    assert bytes_on_wire(MAX_SEGMENT_BYTES) == MAX_SEGMENT_BYTES + HEADER_BYTES
    assert bytes_on_wire(MAX_SEGMENT_BYTES + 1) == MAX_SEGMENT_BYTES + 1 + 2 * HEADER_BYTES


def test_what_nobody_looked_out_for_says_nothing() -> None:
    window = CongestionWindow()
    window.record_write(0, 100)
    window.record_ack(5 * SECOND, 0)
    assert window.throughput is None
    assert not window.is_constrained(5 * SECOND)


def test_what_has_come_is_told_by_its_bytes() -> None:
    window = CongestionWindow()
    assert window.is_acked(0)
    for _ in range(3):
        window.record_write(0, 100)
    assert [window.is_acked(written) for written in (0, 99, 100)] == [True, True, False]
    window.record_ack(50_000, 150)
    assert [window.is_acked(written) for written in (100, 199, 200)] == [True, True, False]
    window.record_ack(60_000, 0)
    assert window.is_acked(300)


def test_what_was_written_besides_is_waited_for_but_not_counted() -> None:
    window = CongestionWindow()
    window.record_write(0, 1_000)
    window.record_untracked_write(500)
    assert window.written == 1_500
    assert window.in_flight_bytes == bytes_on_wire(1_000)
    # the system knows of both: the first is acknowledged when only what came after it is waiting
    window.record_ack(50_000, 501)
    assert window.in_flight_bytes > 0
    window.record_ack(60_000, 500)
    assert window.in_flight_bytes == 0
    assert window.has_capacity(60_000)
