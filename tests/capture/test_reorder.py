from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.capture.frame import CapturedFrame
from bunraku.capture.reorder import MAX_WAIT_S, ReorderBuffer, TimedFrame
from tests.capture.network_faults import Arrival, Faults, simulate_arrivals

FAULTS = st.builds(
    Faults,
    loss=st.floats(0.0, 0.05),
    duplicates=st.floats(0.0, 0.2),
    jitter_s=st.floats(0.0, 0.01),
    reordering=st.floats(0.0, 0.1),
    reordering_s=st.floats(0.0, 0.1),
    drift=st.floats(-200e-6, 200e-6),
)


def run(arrivals: list[Arrival], timed: bool = True, counted: bool = True) -> tuple[list[TimedFrame], ReorderBuffer]:
    """Drive a buffer with arrivals, and poll at its deadlines."""
    buffer = ReorderBuffer()
    released: list[TimedFrame] = []
    for arrival in arrivals:
        while (deadline_s := buffer.deadline_s) is not None and deadline_s < arrival.arrival_s:
            due = buffer.poll(deadline_s)
            assert due
            released += due
        frame = CapturedFrame(
            {}, {}, arrival.sender_s if timed else None, arrival.number if counted else None, {"n": arrival.number}
        )
        released += buffer.push(frame, arrival.arrival_s)
    if (deadline_s := buffer.deadline_s) is not None:
        released += buffer.poll(deadline_s + MAX_WAIT_S)
    return released, buffer


@settings(max_examples=60)
@given(faults=FAULTS, seed=st.integers(0, 1 << 30), fps=st.sampled_from([30.0, 60.0, 240.0]), counted=st.booleans())
def test_times_increase_and_frames_stay_in_order(faults: Faults, seed: int, fps: float, counted: bool) -> None:
    count = round(6 * fps)
    arrivals = simulate_arrivals(count, fps, faults, seed)
    released, buffer = run(arrivals, counted=counted)
    times = np.array([timed.time_s for timed in released])
    numbers = np.array([timed.frame.blendshapes["n"] for timed in released])
    assert (np.diff(times) > 0).all()
    # the estimate of the offset may step in the first second
    settled = times > 1.5
    assert (np.diff(numbers[settled]) > 0).all()
    arrived = len({arrival.number for arrival in arrivals})
    statistics = buffer.statistics
    assert statistics.released == len(released)
    assert statistics.released + statistics.duplicates + statistics.late == len(arrivals)
    # frames that were overtaken teach the buffer to wait: few are lost to lateness
    assert arrived - len(released) <= 0.25 * arrived
    assert np.abs((times - numbers / fps)[settled]).max(initial=0.0) < 0.02


@settings(max_examples=20)
@given(seed=st.integers(0, 1 << 30), loss=st.floats(0.0, 0.3))
def test_loss_alone_delays_nothing(seed: int, loss: float) -> None:
    arrivals = simulate_arrivals(300, 60.0, Faults(loss=loss, duplicates=0.0, reordering=0.0, jitter_s=0.002), seed)
    buffer = ReorderBuffer()
    for arrival in arrivals:
        frame = CapturedFrame({}, {}, arrival.sender_s, arrival.number)
        assert len(buffer.push(frame, arrival.arrival_s)) == 1


@settings(max_examples=20)
@given(seed=st.integers(0, 1 << 30))
def test_frames_without_times_are_spaced_evenly(seed: int) -> None:
    faults = Faults(duplicates=0.0, reordering=0.0, jitter_s=0.003)
    arrivals = simulate_arrivals(600, 60.0, faults, seed)
    released, _ = run(arrivals, timed=False, counted=False)
    assert len(released) == len(arrivals)
    intervals = 60.0 * np.diff([timed.time_s for timed in released])[200:]
    assert (intervals > 0).all()
    assert np.percentile(np.abs(intervals - np.round(intervals)), 90) < 0.15


def test_hostile_times_keep_the_buffer_bounded() -> None:
    chance = np.random.default_rng(5)
    buffer = ReorderBuffer()
    last_s = -np.inf
    for number in range(5_000):
        frame = CapturedFrame({}, {}, float(chance.uniform(-1e9, 1e9)), number)
        for timed in buffer.push(frame, number / 1_000.0):
            assert timed.time_s > last_s
            last_s = timed.time_s
        assert len(buffer._waiting) <= 65


def test_missing_frames_are_counted_and_pauses_are_not() -> None:
    numbers = [number for number in range(120) if number not in (30, 50, 51, 52) and not 70 <= number < 110]
    released, buffer = run([Arrival(number, number / 60, number / 60 + 0.002) for number in numbers])
    assert len(released) == len(numbers)
    assert buffer.statistics.missing == 4
