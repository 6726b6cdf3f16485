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

SECOND_US = 1_000_000
OVERLAY_BYTES = 88
"""Size of an overlay of four limbs in its frame."""
OVERLAY_INTERVAL_US = 33_333


@dataclass
class SimulationResult:
    """Result of a simulation: write time and delay of each overlay, microseconds."""

    link: VirtualLink
    window: CongestionWindow
    overlay_delays: list[tuple[int, float]] = field(default_factory=list)

    def delays_between(self, begin: float, end: float) -> list[float]:
        """Return the sorted delays of overlays written between two times in seconds, milliseconds."""
        return sorted(delays / 1e3 for at, delays in self.overlay_delays if begin * SECOND_US <= at < end * SECOND_US)


def simulate(rate_at: Callable[[int], float], delay: int, seconds: float, block: int = 0) -> SimulationResult:
    """Send the newest overlay whenever there is capacity, and one block of `block` bytes per second."""
    line, window = VirtualLink(rate_at, delay), CongestionWindow()
    # as measured by the kernel during the handshake
    min_rtt = 2 * delay + round(120e6 / rate_at(0))
    result = SimulationResult(line, window)
    made_at: int | None = None
    overlay_at, block_at, at, block_queued = OVERLAY_INTERVAL_US, SECOND_US, 0, False
    while at < seconds * SECOND_US:
        if at >= overlay_at:
            made_at, overlay_at = overlay_at, overlay_at + OVERLAY_INTERVAL_US
        if block and at >= block_at:
            block_queued, block_at = True, block_at + SECOND_US
        if window.in_flight_bytes:
            window.record_ack(at, line.unacked_bytes(at), min_rtt)
        if (made_at is not None or block_queued) and window.has_capacity(at):
            size = block if block_queued else OVERLAY_BYTES
            arrives = line.write(at, size)
            window.record_write(at, size)
            if block_queued:
                block_queued = False
            else:
                assert made_at is not None
                result.overlay_delays.append((at, arrives - made_at))
                made_at = None
            continue
        at = (
            min(at + window.retry_delay(), overlay_at)
            if made_at is not None or block_queued or window.in_flight_bytes
            else overlay_at
        )
    return result


@settings(max_examples=30)
@given(st.integers(1_500, 5_000), st.integers(20_000, 150_000))
def test_constrained_link_has_low_latency_and_is_used(rate: int, delay: int) -> None:
    result = simulate(lambda _: float(rate), delay, 30.0)
    delays = result.delays_between(10, 30)
    transmission = bytes_on_wire(OVERLAY_BYTES) / rate * 1e3
    # an interval until there is capacity, the queue, and the link's delay
    assert delays[len(delays) // 2] < delay / 1e3 + 4 * transmission + 120
    assert delays[-1] < delay / 1e3 + 6 * transmission + 250
    offered = bytes_on_wire(OVERLAY_BYTES) * SECOND_US / OVERLAY_INTERVAL_US
    assert len(delays) * bytes_on_wire(OVERLAY_BYTES) / 20.0 > 0.8 * min(rate, offered)
    assert result.window.throughput == pytest.approx(min(rate, offered), rel=0.35)


def test_unconstrained_link_has_no_queue() -> None:
    result = simulate(lambda _: 1e6, 20_000, 20.0, block=800)
    assert max(result.delays_between(1, 20)) < 25 + OVERLAY_INTERVAL_US / 1e3
    assert len(result.delays_between(0, 20)) >= 595
    assert not result.window.is_constrained(20 * SECOND_US)


def test_block_delays_overlays_by_its_transmission_time_only() -> None:
    result = simulate(lambda _: 3_600.0, 75_000, 40.0, block=600)
    delays = result.delays_between(10, 40)
    assert delays[int(0.95 * len(delays))] < 400
    assert result.link.sent_bytes > 0.85 * 3_600 * 40


def test_window_follows_slowdown_and_recovery() -> None:
    result = simulate(lambda at: 1_800.0 if 10 * SECOND_US <= at < 20 * SECOND_US else 7_000.0, 75_000, 32.0)
    assert max(result.delays_between(5, 10)) < 250
    assert max(result.delays_between(12, 20)) < 450
    assert len(result.delays_between(24, 32)) > 0.9 * 8 * 30
    assert result.window.is_constrained(20 * SECOND_US)


@given(st.lists(st.tuples(st.integers(0, 300_000), st.integers(0, 3_000), st.integers(0, 9_000)), max_size=60))
def test_window_has_capacity_once_everything_is_acknowledged(
    events: list[tuple[int, int, int]],
) -> None:
    window, at = CongestionWindow(), 0
    for passed, size, unacked in events:
        at += passed
        if size:
            window.record_write(at, size)
        window.record_ack(at, unacked)
        assert window.in_flight_bytes >= 0
        assert window.limit_bytes > 0
        assert window.retry_delay() > 0
        assert window.has_capacity(at) or window.in_flight_bytes
    window.record_ack(at + 1, 0)
    assert window.in_flight_bytes == 0
    assert window.has_capacity(at + 1)


def test_first_flight_is_allowed_before_any_measurement() -> None:
    window = CongestionWindow()
    written = 0
    while window.has_capacity(0):
        window.record_write(0, 100)
        written += 100 + HEADER_BYTES
    assert INITIAL_WINDOW_BYTES <= written < INITIAL_WINDOW_BYTES + 200
    assert window.throughput is None


def test_bytes_on_wire_include_headers_of_each_packet() -> None:
    assert bytes_on_wire(1) == 1 + HEADER_BYTES
    assert bytes_on_wire(MAX_SEGMENT_BYTES) == MAX_SEGMENT_BYTES + HEADER_BYTES
    assert bytes_on_wire(MAX_SEGMENT_BYTES + 1) == MAX_SEGMENT_BYTES + 1 + 2 * HEADER_BYTES


def test_unpolled_acknowledgement_gives_no_estimate() -> None:
    window = CongestionWindow()
    window.record_write(0, 100)
    window.record_ack(5 * SECOND_US, 0)
    assert window.throughput is None
    assert not window.is_constrained(5 * SECOND_US)


def test_is_acked_compares_bytes_written() -> None:
    window = CongestionWindow()
    assert window.is_acked(0)
    for _ in range(3):
        window.record_write(0, 100)
    assert [window.is_acked(written) for written in (0, 99, 100)] == [True, True, False]
    window.record_ack(50_000, 150)
    assert [window.is_acked(written) for written in (100, 199, 200)] == [True, True, False]
    window.record_ack(60_000, 0)
    assert window.is_acked(300)


def test_untracked_write_is_not_in_flight() -> None:
    window = CongestionWindow()
    window.record_write(0, 1_000)
    window.record_untracked_write(500)
    assert window.written == 1_500
    assert window.in_flight_bytes == bytes_on_wire(1_000)
    # the kernel counts both: the first is acknowledged when only later bytes are unacknowledged
    window.record_ack(50_000, 501)
    assert window.in_flight_bytes > 0
    window.record_ack(60_000, 500)
    assert window.in_flight_bytes == 0
    assert window.has_capacity(60_000)
