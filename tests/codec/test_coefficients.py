from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import coefficients
from bunraku.codec.coefficients import Integers
from bunraku.codec.errors import DamagedBlock
from bunraku.motion.skeleton import CHANNEL_COUNT


def spectrum(seed: int, count: int, size: float) -> Integers:
    random = np.random.default_rng(seed)
    fall = size / (1 + np.arange(count)) ** 1.5
    return np.round(random.laplace(0, 1, (CHANNEL_COUNT, 3, count)) * fall).astype(np.int64)


@given(st.integers(0, 1000), st.integers(1, 60), st.floats(0, 20_000))
def test_coefficients_come_back_bit_for_bit(seed: int, count: int, size: float) -> None:
    q = spectrum(seed, count, size)
    back = coefficients.decode(coefficients.encode(q), count)
    used = back.shape[2]
    np.testing.assert_array_equal(back, q[:, :, :used])
    assert not q[:, :, used:].any()


def test_the_largest_numbers_come_back_and_larger_ones_are_refused() -> None:
    q = np.zeros((CHANNEL_COUNT, 3, 2), dtype=np.int64)
    q[0, 0], q[18, 2] = ((1 << 23) - 2, -(1 << 20)), (-5, 1 << 22)
    np.testing.assert_array_equal(coefficients.decode(coefficients.encode(q), 2), q)
    q[0, 0, 0] = 1 << 25
    with pytest.raises(ValueError, match="too large"):
        coefficients.encode(q)


def test_a_still_block_costs_next_to_nothing() -> None:
    q = np.zeros((CHANNEL_COUNT, 3, 30), dtype=np.int64)
    assert len(coefficients.encode(q)) <= 2
    q[0, :, 0] = (812, -40, 3000)
    assert len(coefficients.encode(q)) <= 24


@given(st.binary(max_size=300), st.integers(1, 120))
def test_any_bytes_decode_or_are_refused(data: bytes, frames: int) -> None:
    try:
        q = coefficients.decode(data, frames)
    except DamagedBlock:
        return
    assert q.shape[2] <= frames
    assert abs(q).max(initial=0) < 1 << 25
