from __future__ import annotations

from bunraku.marionette.ownership import LOST_AFTER
from bunraku.session.deafness import STOOD, Deafness


def test_a_message_that_is_a_little_late_counts_by_itself() -> None:
    deafness = Deafness()
    assert deafness.late(-300, 1_000_000) == 0
    assert deafness.late(20_000, 1_033_000) == 20_000
    assert deafness.late(0, 1_066_000) == 0


def test_time_that_was_lost_counts_until_everyone_could_be_heard_again() -> None:
    deafness = Deafness()
    now = 5_000_000
    assert deafness.late(800_000, now) == 800_000
    assert deafness.late(STOOD, now + 1_000) == 800_000
    assert deafness.late(0, now + LOST_AFTER - 1) == 800_000
    assert deafness.late(0, now + LOST_AFTER) == 0


def test_lost_again_soon_after_both_count() -> None:
    deafness = Deafness()
    assert deafness.late(800_000, 5_000_000) == 800_000
    assert deafness.late(300_000, 5_310_000) == 1_100_000
    assert deafness.late(0, 5_310_000 + LOST_AFTER - 1) == 1_100_000
    assert deafness.late(300_000, 9_000_000) == 300_000
