from __future__ import annotations

from bunraku.marionette.ownership import INPUT_TIMEOUT_US
from bunraku.session.stall import STALL_THRESHOLD_US, EventLoopStallCompensation


def test_a_message_that_is_a_little_late_counts_by_itself() -> None:
    deafness = EventLoopStallCompensation()
    assert deafness.compensate(-300, 1_000_000) == 0
    assert deafness.compensate(20_000, 1_033_000) == 20_000
    assert deafness.compensate(0, 1_066_000) == 0


def test_time_that_was_lost_counts_until_everyone_could_be_heard_again() -> None:
    deafness = EventLoopStallCompensation()
    now = 5_000_000
    assert deafness.compensate(800_000, now) == 800_000
    assert deafness.compensate(STALL_THRESHOLD_US, now + 1_000) == 800_000
    assert deafness.compensate(0, now + INPUT_TIMEOUT_US - 1) == 800_000
    assert deafness.compensate(0, now + INPUT_TIMEOUT_US) == 0


def test_lost_again_soon_after_both_count() -> None:
    deafness = EventLoopStallCompensation()
    assert deafness.compensate(800_000, 5_000_000) == 800_000
    assert deafness.compensate(300_000, 5_310_000) == 1_100_000
    assert deafness.compensate(0, 5_310_000 + INPUT_TIMEOUT_US - 1) == 1_100_000
    assert deafness.compensate(300_000, 9_000_000) == 300_000
