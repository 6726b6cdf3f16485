from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.skeleton_description import (
    MAX_GRID,
    MAX_REFERENCE_BITS,
    MAX_SKELETON_BYTES,
    SkeletonDescription,
    grid_unit_m,
    snap_to_grid,
)
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, TIP_JOINTS, Figure, standard_figure

MAX_LIMB_M = (1 << 17) * grid_unit_m(MAX_GRID)


@given(
    st.integers(0, 999),
    st.floats(0, 1.0),
    st.integers(0, MAX_GRID),
    st.integers(0, MAX_REFERENCE_BITS),
    st.integers(0, 30_000),
)
def test_description_round_trips(seed: int, length: float, grid: int, bits: int, max_reference: int) -> None:
    random = np.random.default_rng(seed)
    tips = np.zeros((JOINT_COUNT, 3))
    tips[list(TIP_JOINTS)] = random.normal(0, length, (len(TIP_JOINTS), 3)).clip(-3, 3)
    figure = snap_to_grid(Figure(random.normal(0, length, (JOINT_COUNT, 3)).clip(-3, 3), tips), grid)
    reference = random.integers(-max_reference, max_reference + 1, (18, 3)).astype(np.float64)
    unpacked = SkeletonDescription.unpack(SkeletonDescription(figure, grid, reference, bits).pack())
    np.testing.assert_allclose(unpacked.figure.offsets, figure.offsets, atol=1e-12)
    np.testing.assert_allclose(unpacked.figure.tips, figure.tips, atol=1e-12)
    np.testing.assert_array_equal(unpacked.reference, reference)
    assert (unpacked.grid, unpacked.reference_bits) == (grid, bits)


def test_symmetric_figure_costs_one_side_whatever_its_axes() -> None:
    reference, figure = np.zeros((18, 3)), snap_to_grid(standard_figure(), 2)
    symmetric_bytes = len(SkeletonDescription(figure, 2, reference, 2).pack())
    assert symmetric_bytes <= 70
    offsets = figure.offsets.copy()
    offsets[JOINT_INDEX["r_knee"]] = offsets[JOINT_INDEX["l_knee"]]
    offsets[JOINT_INDEX["r_elbow"]] = offsets[JOINT_INDEX["l_elbow"]] * [1, -1, -1]
    assert len(SkeletonDescription(Figure(offsets, figure.tips), 2, reference, 2).pack()) <= symmetric_bytes + 2


def test_rounding_to_the_grid_is_within_half_a_unit() -> None:
    figure = standard_figure()
    for grid in range(MAX_GRID + 1):
        assert abs(snap_to_grid(figure, grid).offsets - figure.offsets).max() <= grid_unit_m(grid) / 2 + 1e-12


def test_too_long_bone_is_refused() -> None:
    figure = standard_figure()
    with pytest.raises(ValueError, match=r"9\.1 m long; 3\.3"):
        snap_to_grid(Figure(figure.offsets + np.eye(JOINT_COUNT, 3) * 9.0, figure.tips), 0)


@given(st.binary(max_size=200))
def test_arbitrary_bytes_are_decoded_or_refused(data: bytes) -> None:
    try:
        skeleton = SkeletonDescription.unpack(data)
    except DamagedBlock:
        return
    assert abs(skeleton.figure.offsets).max() < 2 * MAX_LIMB_M
    assert skeleton.reference_bits <= MAX_REFERENCE_BITS


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "0 bytes"),
        (bytes(MAX_SKELETON_BYTES + 1), "1025 bytes"),
        (bytes([15, 0]), "15 reference bits, at most"),
        (bytes([8 << 4, 0]), "grid 8"),
    ],
)
def test_invalid_description_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(DamagedBlock, match=message):
        SkeletonDescription.unpack(data)
