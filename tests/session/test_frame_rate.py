from __future__ import annotations

from bunraku.session.frame_rate import RESTORE_TICKS, FrameRateControl


def test_repeated_lateness_halves_the_frame_rate_until_restored() -> None:
    control = FrameRateControl()
    control.record_lateness(30_000)
    assert control.is_full_rate, "a single late tick must not reduce the rate"
    for _ in range(10):
        control.record_lateness(12_000)
    states = [control.is_full_rate]
    for _ in range(60):
        control.record_lateness(200)
    states.append(control.is_full_rate)
    for _ in range(RESTORE_TICKS):
        control.record_lateness(200)
    states.append(control.is_full_rate)
    assert states == [False, False, True]


def test_moderate_lateness_keeps_the_frame_rate() -> None:
    for is_full_rate, lateness in ((True, 4_000), (False, 4_000)):
        control = FrameRateControl()
        control.is_full_rate = is_full_rate
        for _ in range(1_000):
            control.record_lateness(lateness)
        assert control.is_full_rate == is_full_rate
