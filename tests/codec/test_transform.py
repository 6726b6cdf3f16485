from __future__ import annotations

import numpy as np
import scipy.fft
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import transform
from bunraku.motion.rotation import Array


@given(st.integers(1, 90), st.integers(0, 99))
def test_transform_is_the_orthonormal_dct(frames: int, seed: int) -> None:
    track = np.random.default_rng(seed).normal(size=(frames, 4, 3))
    coefficients = transform.forward_dct(track)
    np.testing.assert_allclose(coefficients, np.moveaxis(scipy.fft.dct(track, norm="ortho", axis=0), 0, -1), atol=1e-9)
    np.testing.assert_allclose(
        transform.inverse_dct(coefficients, frames, np.arange(frames, dtype=np.float64)), track, atol=1e-9
    )


def test_transform_interpolates_a_smooth_track() -> None:
    t = np.arange(40, dtype=np.float64)

    def oscillation(x: Array) -> Array:
        track: Array = np.cos(2 * np.pi * x / 37.0)[:, None]
        return track

    halves = t[3:-3] + 0.5
    between = transform.inverse_dct(transform.forward_dct(oscillation(t)), 40, halves)
    np.testing.assert_allclose(between, oscillation(halves), atol=5e-3)


def test_fewer_coefficients_give_a_smoother_track() -> None:
    track = np.random.default_rng(0).normal(size=(30, 1))
    truncated = transform.inverse_dct(transform.forward_dct(track)[:, :8], 30, np.arange(30, dtype=np.float64))
    assert np.abs(np.diff(truncated, axis=0)).sum() < np.abs(np.diff(track, axis=0)).sum()


@given(st.integers(0, 40), st.integers(1, 20), st.integers(2, 60), st.integers(0, 1 << 30))
def test_value_does_not_depend_on_other_requested_instants(begin: int, count: int, frames: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(19, 3, min(frames, 30)))
    instants = np.linspace(0.0, frames - 1.0, 60)
    all_values = transform.inverse_dct(values, frames, instants)
    np.testing.assert_array_equal(
        transform.inverse_dct(values, frames, instants[begin : begin + count]), all_values[begin : begin + count]
    )
