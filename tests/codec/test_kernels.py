from __future__ import annotations

import numpy as np

from bunraku.codec import kernels


def test_a_block_with_more_frequencies_than_room_is_not_read() -> None:
    q = np.ones((19, 3, 6), dtype=np.int64)
    out = np.zeros(4096, dtype=np.uint8)
    length = kernels.encode(q, out)
    room = np.zeros((19, 3, 5), dtype=np.int64)
    assert kernels.decode(out[1:length], room) == 6
    assert not room.any()
    room = np.zeros((19, 3, 9), dtype=np.int64)
    assert kernels.decode(out[1:length], room) == 6
    np.testing.assert_array_equal(room[:, :, :6], q)


def test_models_learn_within_a_block() -> None:
    q = np.zeros((19, 3, 30), dtype=np.int64)
    q[:, 0] = 3
    out = np.zeros(1 << 16, dtype=np.uint8)
    # 570 equal numbers cost little more than their signs
    assert kernels.encode(q, out) < 570 / 8 * 2.6
