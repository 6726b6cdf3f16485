from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import (
    MAX_BLENDSHAPES,
    CapturedFrame,
    check_position,
    check_rotation,
    check_weight,
    date_frame,
    mirror_position,
    mirror_rotation,
)
from bunraku.motion.unity_axes import mirror_rotations, mirror_vectors

NUMBERS = st.floats(width=32)


@given(values=st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS))
def test_rotations_are_unit_or_rejected(values: tuple[float, float, float, float]) -> None:
    size = math.sqrt(sum(value * value for value in values))
    if abs(size - 1.0) <= 0.009:
        assert np.linalg.norm(check_rotation(values, "Hips")) == pytest.approx(1.0, abs=1e-12)
    elif not abs(size - 1.0) <= 0.011:
        with pytest.raises(UnreadableCapture, match="Hips"):
            check_rotation(values, "Hips")


@given(values=st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_positions_are_finite_and_bounded_or_rejected(values: tuple[float, float, float]) -> None:
    if all(abs(value) <= 1e6 for value in values):
        assert check_position(values, "Hips") == values
    else:
        with pytest.raises(UnreadableCapture, match="Hips"):
            check_position(values, "Hips")


def test_weights_are_bounded() -> None:
    assert check_weight("Joy", -0.5, 1) == -0.5
    for name, value, count in (("", 0.0, 1), ("Joy", math.nan, 1), ("Joy", 0.0, MAX_BLENDSHAPES + 1)):
        with pytest.raises(UnreadableCapture, match="Invalid blendshape"):
            check_weight(name, value, count)


def test_coarse_times_are_dropped() -> None:
    frame = CapturedFrame({}, {})
    assert date_frame(frame, None) is frame
    assert date_frame(frame, 1e9).sender_time_s is None
    dated = date_frame(frame, 1_000.0)
    assert dated.sender_time_s == 1_000.0
    assert np.spacing(np.float32(1_000.0)) <= dated.time_resolution_s <= 2 * np.spacing(np.float32(1_000.0))


def test_mirroring_agrees_with_whole_arrays() -> None:
    assert mirror_position((1.0, 2.0, 3.0)) == tuple(mirror_vectors(np.array([1.0, 2.0, 3.0])))
    assert mirror_rotation((1.0, 2.0, 3.0, 4.0)) == tuple(mirror_rotations(np.array([1.0, 2.0, 3.0, 4.0])))
