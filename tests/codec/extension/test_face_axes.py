from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.face_axes import create_face_layout, face_weights, pack_face, unpack_face
from bunraku.motion.face import AXIS_COUNT, Face

axes = st.lists(st.integers(0, AXIS_COUNT - 1), min_size=1, unique=True).map(sorted).map(tuple)


@given(axes, st.integers(0, 1000))
def test_description_round_trips(numbers: tuple[int, ...], seed: int) -> None:
    offsets = np.random.default_rng(seed).integers(-8, 8, len(numbers))
    face, same = unpack_face(pack_face(Face(numbers), offsets))
    assert face.axes == numbers
    np.testing.assert_array_equal(same, offsets)
    layout = create_face_layout(face, same)
    assert layout.axes.sum() == len(numbers)
    assert len(face_weights(face)) == len(layout.axes)


@given(st.binary(max_size=60))
def test_damaged_description_is_refused_or_in_range(data: bytes) -> None:
    try:
        face, offsets = unpack_face(data)
    except DamagedBlock:
        return
    assert len(face.axes) == len(offsets) > 0
    assert -8 <= offsets.min() <= offsets.max() <= 7


@pytest.mark.parametrize("data", [b"", bytes(8), b"\1", b"\1" + bytes(300)])
def test_description_without_axes_or_of_another_size_is_refused(data: bytes) -> None:
    with pytest.raises(DamagedBlock, match="Invalid face"):
        unpack_face(data)
