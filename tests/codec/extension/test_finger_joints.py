from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.finger_joints import create_finger_layout, finger_weights, pack_fingers, unpack_fingers
from bunraku.motion.hands import CHAIN_COUNT
from tests.vectors.hands_face import make_hands


@given(st.tuples(*[st.integers(0, 3)] * CHAIN_COUNT).filter(any), st.integers(0, 1000))
def test_description_round_trips(counts: tuple[int, ...], seed: int) -> None:
    hands, _ = make_hands(1, counts, 2)
    offsets = np.random.default_rng(seed).integers(-8, 8, 3 * sum(counts))
    packed = pack_fingers(hands, offsets)
    unpacked, same = unpack_fingers(packed)
    assert unpacked.counts == counts
    np.testing.assert_array_equal(same, offsets)
    np.testing.assert_allclose(unpacked.bases, hands.bases, atol=2.5e-4 + 1e-12)
    np.testing.assert_allclose(unpacked.lengths, hands.lengths, atol=2.5e-4 + 1e-12)
    assert pack_fingers(unpacked, same) == packed
    layout = create_finger_layout(unpacked, same)
    assert layout.scale_offsets.shape == (sum(counts), 3)
    assert np.isfinite(np.linalg.inv(finger_weights(unpacked))).all()


def test_two_equal_hands_take_little_more_than_one() -> None:
    one, _ = make_hands(1, (3,) * 5 + (0,) * 5, 2)
    both, _ = make_hands(1, (3,) * 10, 2)
    offsets = np.arange(45) % 7 - 3
    assert len(pack_fingers(both, np.tile(offsets, 2))) < 1.6 * len(pack_fingers(one, offsets))


@given(st.binary(max_size=80))
def test_damaged_description_is_refused_or_finite(data: bytes) -> None:
    try:
        hands, offsets = unpack_fingers(data)
    except DamagedBlock:
        return
    assert np.isfinite(hands.lengths).all()
    assert np.abs(offsets).max() <= 8


@pytest.mark.parametrize("data", [b"", b"\0\0", bytes(3), b"\1\0\x10", b"\1\0\0" + bytes(600)])
def test_description_without_joints_or_of_another_size_is_refused(data: bytes) -> None:
    with pytest.raises(DamagedBlock, match="Invalid fingers"):
        unpack_fingers(data)
