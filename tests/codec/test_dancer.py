from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.dancer import FIGURE_UNIT, LARGEST_DANCER, MOST_BITS, on_grid, pack_dancer, unpack_dancer
from bunraku.codec.errors import DamagedBlock
from bunraku.motion.skeleton import JOINT_COUNT, TIPS, Figure, standard_figure


@given(st.integers(0, 999), st.floats(0, 1.0), st.integers(0, MOST_BITS), st.integers(0, 30_000))
def test_dancers_survive_their_bytes(seed: int, size: float, bits: int, turn: int) -> None:
    random = np.random.default_rng(seed)
    tips = np.zeros((JOINT_COUNT, 3))
    tips[list(TIPS)] = random.normal(0, size, (len(TIPS), 3)).clip(-3, 3)
    figure = on_grid(Figure(random.normal(0, size, (JOINT_COUNT, 3)).clip(-3, 3), tips))
    reference = random.integers(-turn, turn + 1, (17, 3)).astype(np.float64)
    again, turned, precision = unpack_dancer(pack_dancer(figure, reference, bits))
    np.testing.assert_allclose(again.offsets, figure.offsets, atol=1e-12)
    np.testing.assert_allclose(again.tips, figure.tips, atol=1e-12)
    np.testing.assert_array_equal(turned, reference)
    assert precision == bits


def test_a_symmetric_figure_is_about_a_hundred_bytes_at_most() -> None:
    reference = np.random.default_rng(1).integers(-8, 9, (17, 3)).astype(np.float64)
    assert len(pack_dancer(on_grid(standard_figure()), reference, 3)) <= 120


def test_the_figure_moves_by_half_a_grid_step_at_most() -> None:
    figure = standard_figure()
    assert abs(on_grid(figure).offsets - figure.offsets).max() <= FIGURE_UNIT / 2 + 1e-12


def test_giants_are_refused() -> None:
    figure = standard_figure()
    with pytest.raises(ValueError, match=r"9\.1 m long; 3\.3"):
        on_grid(Figure(figure.offsets + np.eye(JOINT_COUNT, 3) * 9.0, figure.tips))


@given(st.binary(max_size=200))
def test_any_bytes_are_a_dancer_or_refused(data: bytes) -> None:
    try:
        figure, _, bits = unpack_dancer(data)
    except DamagedBlock:
        return
    assert abs(figure.offsets).max() < 30
    assert bits <= MOST_BITS


@pytest.mark.parametrize(
    ("data", "says"), [(b"", "not 0"), (bytes(LARGEST_DANCER + 1), "not 1025"), (bytes([15, 0]), "finest")]
)
def test_wrong_dancers_are_refused(data: bytes, says: str) -> None:
    with pytest.raises(DamagedBlock, match=says):
        unpack_dancer(data)
