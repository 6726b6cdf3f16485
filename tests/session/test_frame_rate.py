from __future__ import annotations

from bunraku.session.frame_rate import RESTORE_TICKS, FrameRateControl


def test_a_stage_that_is_late_for_a_while_leaves_frames_out_and_takes_them_up_again_later() -> None:
    pace = FrameRateControl()
    pace.record_lateness(30_000)
    assert pace.is_full_rate, "once is no matter"
    for _ in range(10):
        pace.record_lateness(12_000)
    states = [pace.is_full_rate]
    for _ in range(60):
        pace.record_lateness(200)
    states.append(pace.is_full_rate)
    for _ in range(RESTORE_TICKS):
        pace.record_lateness(200)
    states.append(pace.is_full_rate)
    assert states == [False, False, True]


def test_a_stage_that_is_neither_late_nor_quite_in_time_stays_as_it_is() -> None:
    for full, lateness in ((True, 4_000), (False, 4_000)):
        pace = FrameRateControl()
        pace.is_full_rate = full
        for _ in range(1_000):
            pace.record_lateness(lateness)
        assert pace.is_full_rate == full
