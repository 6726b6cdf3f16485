from __future__ import annotations

from bunraku.session.pace import PATIENCE, Pace


def test_a_stage_that_is_late_for_a_while_leaves_frames_out_and_takes_them_up_again_later() -> None:
    pace = Pace()
    pace.late(30_000)
    assert pace.full, "once is no matter"
    for _ in range(10):
        pace.late(12_000)
    states = [pace.full]
    for _ in range(60):
        pace.late(200)
    states.append(pace.full)
    for _ in range(PATIENCE):
        pace.late(200)
    states.append(pace.full)
    assert states == [False, False, True]


def test_a_stage_that_is_neither_late_nor_quite_in_time_stays_as_it_is() -> None:
    for full, lateness in ((True, 4_000), (False, 4_000)):
        pace = Pace()
        pace.full = full
        for _ in range(1_000):
            pace.late(lateness)
        assert pace.full == full
