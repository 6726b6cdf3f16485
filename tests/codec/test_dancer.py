from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.dancer import LARGEST_DANCER, MOST_BITS, MOST_GRID, Dancer, on_grid, unit
from bunraku.codec.errors import DamagedBlock
from bunraku.motion.skeleton import INDEX, JOINT_COUNT, TIPS, Figure, standard_figure

LARGEST_LIMB = (1 << 17) * unit(MOST_GRID)


@given(
    st.integers(0, 999), st.floats(0, 1.0), st.integers(0, MOST_GRID), st.integers(0, MOST_BITS), st.integers(0, 30_000)
)
def test_dancers_survive_their_bytes(seed: int, size: float, grid: int, bits: int, turn: int) -> None:
    random = np.random.default_rng(seed)
    tips = np.zeros((JOINT_COUNT, 3))
    tips[list(TIPS)] = random.normal(0, size, (len(TIPS), 3)).clip(-3, 3)
    figure = on_grid(Figure(random.normal(0, size, (JOINT_COUNT, 3)).clip(-3, 3), tips), grid)
    reference = random.integers(-turn, turn + 1, (18, 3)).astype(np.float64)
    again = Dancer.unpack(Dancer(figure, grid, reference, bits).pack())
    np.testing.assert_allclose(again.figure.offsets, figure.offsets, atol=1e-12)
    np.testing.assert_allclose(again.figure.tips, figure.tips, atol=1e-12)
    np.testing.assert_array_equal(again.reference, reference)
    assert (again.grid, again.reference_bits) == (grid, bits)


def test_a_mirrored_figure_costs_one_side_whatever_axes_its_bones_have() -> None:
    reference, figure = np.zeros((18, 3)), on_grid(standard_figure(), 2)
    size = len(Dancer(figure, 2, reference, 2).pack())
    assert size <= 70
    offsets = figure.offsets.copy()
    offsets[INDEX["r_knee"]] = offsets[INDEX["l_knee"]]
    offsets[INDEX["r_elbow"]] = offsets[INDEX["l_elbow"]] * [1, -1, -1]
    assert len(Dancer(Figure(offsets, figure.tips), 2, reference, 2).pack()) <= size + 2


def test_the_figure_moves_by_half_a_grid_step_at_most() -> None:
    figure = standard_figure()
    for grid in range(MOST_GRID + 1):
        assert abs(on_grid(figure, grid).offsets - figure.offsets).max() <= unit(grid) / 2 + 1e-12


def test_giants_are_refused() -> None:
    figure = standard_figure()
    with pytest.raises(ValueError, match=r"9\.1 m long; 3\.3"):
        on_grid(Figure(figure.offsets + np.eye(JOINT_COUNT, 3) * 9.0, figure.tips), 0)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_dancer_or_refused(data: bytes) -> None:
    try:
        dancer = Dancer.unpack(data)
    except DamagedBlock:
        return
    assert abs(dancer.figure.offsets).max() < 2 * LARGEST_LIMB
    assert dancer.reference_bits <= MOST_BITS


@pytest.mark.parametrize(
    ("data", "says"),
    [(b"", "not 0"), (bytes(LARGEST_DANCER + 1), "not 1025"), (bytes([15, 0]), "most"), (bytes([8 << 4, 0]), "most")],
)
def test_wrong_dancers_are_refused(data: bytes, says: str) -> None:
    with pytest.raises(DamagedBlock, match=says):
        Dancer.unpack(data)
