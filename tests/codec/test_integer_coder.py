from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.integer_coder import decode_integers, encode_integers

INTEGERS = st.lists(st.integers(-40_000, 40_000) | st.integers(-3, 3), min_size=1, max_size=60)


@given(INTEGERS, st.randoms(use_true_random=False))
def test_numbers_come_back_with_any_groups_and_twins(values: list[int], random: np.random.Generator) -> None:
    groups = np.array([random.randint(0, 5) for _ in values])  # type: ignore[attr-defined]
    twins = np.array([random.randint(-1, i - 1) for i in range(len(values))])  # type: ignore[attr-defined]
    numbers = np.array(values)
    np.testing.assert_array_equal(decode_integers(encode_integers(numbers, groups, twins), groups, twins), numbers)


def test_what_is_like_its_twin_costs_little() -> None:
    numbers = np.random.default_rng(1).integers(-3000, 3000, 60)
    numbers[30:] = -numbers[:30]
    alone = encode_integers(numbers, np.zeros(60, int), np.full(60, -1))
    twins = np.array([-1] * 30 + list(range(30)))
    assert len(encode_integers(numbers, (twins >= 0).astype(int), twins)) < 0.62 * len(alone)


def test_too_large_a_number_is_refused() -> None:
    with pytest.raises(ValueError, match="too large"):
        encode_integers(np.array([1 << 17]), np.array([0]), np.array([-1]))


@given(st.binary(max_size=60))
def test_any_bytes_are_numbers_or_refused(data: bytes) -> None:
    try:
        found = decode_integers(data, np.zeros(40, int), np.full(40, -1))
    except DamagedBlock:
        return
    assert abs(found).max() < 1 << 17


def test_reading_a_track_loads_no_compiled_code() -> None:
    code = "import sys, bunraku.codec.motion_track; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60, check=False).returncode == 0
