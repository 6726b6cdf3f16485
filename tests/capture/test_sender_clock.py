from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.capture.sender_clock import MAX_DRIFT, MAX_SLEW, SETTLING_S, ArrivalClock, SenderClock

RATES = st.sampled_from([30.0, 60.0, 120.0, 240.0])


@settings(max_examples=40)
@given(
    seed=st.integers(0, 1 << 30),
    fps=RATES,
    offset_s=st.floats(-1e6, 1e6),
    drift=st.floats(-MAX_DRIFT, MAX_DRIFT),
    jitter_s=st.floats(0.0, 0.03),
)
def test_times_follow_the_sender_at_the_least_delay(
    seed: int, fps: float, offset_s: float, drift: float, jitter_s: float
) -> None:
    chance = np.random.default_rng(seed)
    clock = SenderClock()
    sampled = np.arange(round(20 * fps)) / fps
    arrivals = sampled + 0.005 + chance.exponential(jitter_s / 3 + 1e-9, len(sampled)).clip(max=jitter_s)
    local = np.array([clock.to_local(t * (1.0 + drift) + offset_s, a) for t, a in zip(sampled, arrivals, strict=True)])
    settled = sampled > SETTLING_S + 1.0
    assert np.abs(np.diff(local[settled]) * fps - 1.0).max() <= MAX_SLEW + MAX_DRIFT + 1e-6
    # never later than the arrival, but for a least delay that is seen after the offset may be followed at once
    late_s = (arrivals - sampled)[sampled < SETTLING_S - 0.05].min() - 0.005
    assert (local <= arrivals + 1e-3 + late_s).all()
    # never earlier than the sampling by more than the estimate may err
    assert np.abs(local[settled] - sampled[settled] - 0.005).max() < 0.004 + jitter_s


def test_restarted_sender_begins_anew() -> None:
    clock = SenderClock()
    assert clock.to_local(100.0, 5.0) == pytest.approx(5.0)
    assert clock.to_local(100.1, 5.1) == pytest.approx(5.1)
    assert clock.to_local(0.0, 5.2) == pytest.approx(5.2)
    assert clock.to_local(500.0, 5.3) == pytest.approx(5.3)


@pytest.mark.parametrize("fps", [60.0, 240.0])
def test_whole_milliseconds_are_smoothed_by_the_counter(fps: float) -> None:
    clock = SenderClock()
    start = (1 << 32) - 100
    local = np.array(
        [
            clock.to_local(round(1000 * n / fps) / 1000, n / fps, (start + n) % (1 << 32), resolution_s=0.001)
            for n in range(600)
        ]
    )
    assert np.abs(np.diff(local)[100:] - 1.0 / fps).max() < 1.5e-4


def test_single_precision_after_nine_hours_is_smoothed() -> None:
    chance = np.random.default_rng(3)
    clock = SenderClock()
    kept = [n for n in range(900) if chance.random() > 0.05]
    sent = [float(np.float32(32_400.0 + n / 60.0)) for n in kept]
    local = np.array([clock.to_local(t, n / 60.0, resolution_s=2.0**-23 * t) for n, t in zip(kept, sent, strict=True)])
    errors = np.diff(local) - np.diff(kept) / 60.0
    assert np.abs(np.diff(sent) - np.diff(kept) / 60.0).max() > 0.9e-3
    assert np.abs(errors[200:]).max() < 4e-4


def test_unsteady_sender_keeps_its_times() -> None:
    for counted in (True, False):
        clock = SenderClock()
        times = np.cumsum(np.random.default_rng(4).uniform(0.01, 0.05, 200))
        local = np.array(
            [
                clock.to_local(time_s, time_s, number if counted else None, resolution_s=0.001)
                for number, time_s in enumerate(times.tolist())
            ]
        )
        np.testing.assert_allclose(local, times, atol=2.1e-3)


@settings(max_examples=40)
@given(seed=st.integers(0, 1 << 30), fps=RATES, loss=st.floats(0.0, 0.1))
def test_arrivals_are_smoothed_to_the_frame_rate(seed: int, fps: float, loss: float) -> None:
    chance = np.random.default_rng(seed)
    clock = ArrivalClock()
    sampled = np.arange(2_000) / fps
    sampled = sampled[chance.random(len(sampled)) >= loss]
    arrivals = sampled + chance.uniform(0.0, 0.2 / fps, len(sampled))
    local = np.array([clock.to_local(arrival) for arrival in arrivals])
    assert (np.diff(local) > 0).all()
    rate_error = np.diff(local)[500:] * fps
    assert np.abs(rate_error - np.round(rate_error)).max() < 0.06
    assert np.abs(local - arrivals)[500:].max() < 1.0 / fps


def test_pause_of_the_sender_restarts_the_smoothing() -> None:
    clock = ArrivalClock()
    assert clock.to_local(1.0) == 1.0
    assert clock.to_local(60.0) == 60.0
