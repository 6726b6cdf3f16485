from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.integer_coder import decode_integers, encode_integers
from tests.time_limit import HANG_TIMEOUT_S

INTEGERS = st.lists(st.integers(-40_000, 40_000) | st.integers(-3, 3), min_size=1, max_size=60)


@given(INTEGERS, st.randoms(use_true_random=False))
def test_integers_round_trip_with_any_groups_and_mirrors(values: list[int], random: np.random.Generator) -> None:
    groups = np.array([random.randint(0, 5) for _ in values])  # type: ignore[attr-defined]
    mirrors = np.array([random.randint(-1, i - 1) for i in range(len(values))])  # type: ignore[attr-defined]
    data = encode_integers(np.array(values), groups, mirrors)
    np.testing.assert_array_equal(decode_integers(data, groups, mirrors), values)


def test_mirrored_integers_cost_little() -> None:
    integers = np.random.default_rng(1).integers(-3000, 3000, 60)
    integers[30:] = -integers[:30]
    unpredicted = encode_integers(integers, np.zeros(60, int), np.full(60, -1))
    mirrors = np.array([-1] * 30 + list(range(30)))
    assert len(encode_integers(integers, (mirrors >= 0).astype(int), mirrors)) < 0.62 * len(unpredicted)


def test_too_large_integer_is_refused() -> None:
    with pytest.raises(ValueError, match="too large"):
        encode_integers(np.array([1 << 17]), np.array([0]), np.array([-1]))


@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_decoded_or_refused(data: bytes) -> None:
    try:
        integers = decode_integers(data, np.zeros(40, int), np.full(40, -1))
    except DamagedBlock:
        return
    assert abs(integers).max() < 1 << 17


def test_parsing_a_track_does_not_import_numba() -> None:
    code = "import sys, bunraku.codec.motion_track; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=HANG_TIMEOUT_S, check=False).returncode == 0
