from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.client.one_euro import OneEuro

VALUE = st.floats(-100, 100)
STEP = st.floats(1e-3, 0.2)


@given(st.tuples(VALUE, VALUE, VALUE), st.lists(st.floats(0, 0.5), max_size=30))
def test_a_constant_comes_through_to_the_last_bit(constant: tuple[float, float, float], steps: list[float]) -> None:
    smooth, seconds = OneEuro(), 0.0
    for passed in steps:
        seconds += passed
        assert smooth.filter(constant, seconds) == constant


def test_noise_is_taken_from_what_rests_and_more_the_lower_the_cutoff() -> None:
    samples = np.random.default_rng(3).normal(0, 1, 4000)
    left = []
    for cutoff in (4.0, 1.0, 0.25):
        smooth = OneEuro(cutoff, 0.0)
        left.append(np.var([smooth.filter([x], i / 60)[0] for i, x in enumerate(samples)][600:]))
    assert 0.5 * np.var(samples) > left[0] > left[1] > left[2]
    assert left[2] < 0.03


@given(VALUE, VALUE, st.floats(0.2, 5), st.lists(st.floats(1e-3, 0.1), min_size=5, max_size=60))
def test_a_step_is_followed_without_passing_it(start: float, end: float, cutoff: float, steps: list[float]) -> None:
    smooth = OneEuro(cutoff, 0.5)
    smooth.filter([start], 0.0)
    seconds, last = 0.0, start
    settled = 7 / (2 * math.pi * cutoff)
    for passed in [*steps, *[settled / 200] * 200]:
        seconds += passed
        (now,) = smooth.filter([end], seconds)
        assert abs(end - now) <= abs(end - last) + 1e-12
        assert (end - now) * (end - start) >= -1e-9
        last = now
    assert abs(end - last) < 1.1e-3 * abs(end - start) + 1e-9


@given(st.lists(st.tuples(VALUE, VALUE, STEP), min_size=1, max_size=20))
def test_of_samples_of_one_time_the_last_counts(samples: list[tuple[float, float, float]]) -> None:
    twice, once, seconds = OneEuro(), OneEuro(), 0.0
    for stale, fresh, passed in samples:
        seconds += passed
        twice.filter([stale], seconds)
        assert twice.filter([fresh], seconds - passed / 2) == once.filter([fresh], seconds)


def test_it_forgets_when_told_to_and_refuses_what_is_no_sample() -> None:
    smooth = OneEuro()
    smooth.filter([1.0, 1.0], 0.0)
    smooth.reset()
    assert smooth.filter([5.0, 6.0], 0.01) == (5.0, 6.0)
    for values, seconds in (([math.nan, 1.0], 1.0), ([1.0, 2.0], math.inf), ([1.0], 1.0)):
        with pytest.raises(ValueError, match="a sample"):
            smooth.filter(values, seconds)
    assert smooth.filter([5.0, 6.0], 0.02) == (5.0, 6.0)
    with pytest.raises(ValueError, match="cutoffs"):
        OneEuro(0.0)
