from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bunraku.playout.clock import MAX_CLOCK_DRIFT, MAX_SLEW_RATE, ReferenceClock

OFFSET = 3_600_000_000  # a client's clock an hour off


def exchange_ping(clock: ReferenceClock, sent: int, out: int, back: int, offset: int = OFFSET) -> None:
    received = sent + out + offset
    clock.add_sample(sent, received, received + 50, sent + out + 50 + back)


def test_fastest_sample_of_each_direction_determines_offset() -> None:
    clock = ReferenceClock()
    assert not clock.is_synchronised
    for i, (out, back) in enumerate([(400_000, 20_000), (300_000, 200_000), (20_000, 900_000)]):
        exchange_ping(clock, i * 1_000_000, out, back)
    assert abs(clock.offset - OFFSET) <= MAX_CLOCK_DRIFT * 3_000_000
    assert 20_000 <= clock.error_bound < 20_000 + MAX_CLOCK_DRIFT * 3_000_000


def test_stepped_clock_discards_older_samples() -> None:
    clock = ReferenceClock()
    for second in range(4):
        exchange_ping(clock, second * 1_000_000, 20_000, 30_000)
    exchange_ping(clock, 5_000_000, 30_000, 30_000, OFFSET + 500_000)
    assert clock.offset == OFFSET + 500_000
    assert clock.error_bound == 30_000


@given(st.lists(st.tuples(st.integers(1_000, 500_000), st.integers(1_000, 500_000)), min_size=1, max_size=20))
def test_error_bound_is_never_exceeded(trips: list[tuple[int, int]]) -> None:
    clock = ReferenceClock()
    for i, (out, back) in enumerate(trips):
        exchange_ping(clock, i * 2_000_000, out, back)
        assert abs(clock.offset - OFFSET) <= clock.error_bound


@given(st.lists(st.tuples(st.integers(1_000, 500_000), st.integers(1_000, 500_000)), min_size=2, max_size=30))
def test_time_in_use_is_monotonic_and_slews(trips: list[tuple[int, int]]) -> None:
    clock = ReferenceClock()
    exchange_ping(clock, 0, *trips[0])
    local = 2_000_000
    before = clock.at(local)
    for out, back in trips[1:]:
        exchange_ping(clock, local, out, back)
        for _ in range(20):
            local += 100_000
            now = clock.at(local)
            assert abs((now - before) - 100_000) <= MAX_SLEW_RATE * 100_000 + 1
            before = now


def test_drift_of_200_ppm_is_tracked() -> None:
    clock = ReferenceClock()
    local = 0
    for second in range(0, 120, 2):
        local = second * 1_000_000
        exchange_ping(clock, local, 30_000, 30_000, OFFSET + second * 200)
        clock.at(local + 60_050)
    assert abs(clock.at(local + 100_000) - (local + 100_000 + OFFSET + 118 * 200)) < 5_000


def test_negative_round_trip_is_ignored() -> None:
    clock = ReferenceClock()
    clock.add_sample(1_000, 500_000, 400_000, 2_000)
    clock.add_sample(1_000, 500_000, 502_000, 2_000)
    assert not clock.is_synchronised
    assert clock.at(7) == 7


def test_estimate_is_used_until_first_sample() -> None:
    clock = ReferenceClock()
    clock.set_estimate(5_000_000, 1_000_000)
    assert clock.at(1_500_000) == 5_500_000
    assert not clock.is_synchronised
    exchange_ping(clock, 2_000_000, 10_000, 10_000)
    assert clock.at(2_020_050) == 2_020_050 + OFFSET
    clock.set_estimate(0, 0)
    assert clock.at(2_020_060) == 2_020_060 + OFFSET


def test_restart_discards_samples_without_step() -> None:
    clock = ReferenceClock()
    exchange_ping(clock, 0, 20_000, 20_000)
    before = clock.at(1_000_000)
    clock.restart()
    assert clock.error_bound == float("inf")
    assert clock.at(1_010_000) == before + 10_000
    # the first sample is asymmetric
    exchange_ping(clock, 1_020_000, 20_000, 420_000)
    after = clock.at(1_500_000)
    assert abs(after - before - 500_000) <= 200_000
    assert clock.at(1_510_000) > after
