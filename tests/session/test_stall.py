from __future__ import annotations

from bunraku.marionette.ownership import INPUT_TIMEOUT_US
from bunraku.session.stall import STALL_THRESHOLD_US, EventLoopStallCompensation


def test_short_lateness_is_compensated_once() -> None:
    compensation = EventLoopStallCompensation()
    assert compensation.compensate(-300, 1_000_000) == 0
    assert compensation.compensate(20_000, 1_033_000) == 20_000
    assert compensation.compensate(0, 1_066_000) == 0


def test_stall_is_compensated_for_the_input_timeout() -> None:
    compensation = EventLoopStallCompensation()
    now = 5_000_000
    assert compensation.compensate(800_000, now) == 800_000
    assert compensation.compensate(STALL_THRESHOLD_US, now + 1_000) == 800_000
    assert compensation.compensate(0, now + INPUT_TIMEOUT_US - 1) == 800_000
    assert compensation.compensate(0, now + INPUT_TIMEOUT_US) == 0


def test_consecutive_stalls_add_up() -> None:
    compensation = EventLoopStallCompensation()
    assert compensation.compensate(800_000, 5_000_000) == 800_000
    assert compensation.compensate(300_000, 5_310_000) == 1_100_000
    assert compensation.compensate(0, 5_310_000 + INPUT_TIMEOUT_US - 1) == 1_100_000
    assert compensation.compensate(300_000, 9_000_000) == 300_000
