from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import coefficients, prior
from bunraku.codec.coefficients import MAX_BLOCK_BYTES, SCENE_CHANNEL_COUNT, BlockHeader
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import IntArray
from bunraku.motion.skeleton import CHANNEL_COUNT

PRIOR = prior.load_shipped_prior()
FPS = 30.0


def random_coefficients(seed: int, count: int, magnitude: float) -> IntArray:
    random = np.random.default_rng(seed)
    fall = magnitude / (1 + np.arange(count)) ** 1.5
    return np.round(random.laplace(0, 1, (CHANNEL_COUNT, 3, count)) * fall).astype(np.int64)


@given(
    st.integers(0, 1000),
    st.integers(1, 60),
    st.floats(0, 20_000),
    st.builds(BlockHeader, st.integers(60, 512), st.integers(0, 255), st.integers(-32, 31)),
    st.sampled_from([60, 30]),
)
def test_heads_and_coefficients_come_back_bit_for_bit(
    seed: int, count: int, size: float, head: BlockHeader, usual: int
) -> None:
    q = random_coefficients(seed, count, size)
    again, back = coefficients.decode_coefficients(
        PRIOR, coefficients.encode_coefficients(PRIOR, head, q, usual, FPS), usual, FPS
    )
    assert again == head
    used = back.shape[2]
    np.testing.assert_array_equal(back, q[:, :, :used])
    assert not q[:, :, used:].any()


@given(st.integers(0, 1000), st.integers(1, 60), st.floats(0, 20_000), st.integers(60, 512), st.integers(0, 255))
def test_a_scene_comes_back_bit_for_bit(seed: int, count: int, size: float, frames: int, step: int) -> None:
    q = random_coefficients(seed, count, size)[:SCENE_CHANNEL_COUNT]
    q[2, 1:] = 0
    head = BlockHeader(frames, step, 0)
    again, back = coefficients.decode_coefficients(
        PRIOR, coefficients.encode_coefficients(PRIOR, head, q, 60, FPS), 60, FPS, SCENE_CHANNEL_COUNT
    )
    assert again == head
    used = back.shape[2]
    np.testing.assert_array_equal(back, q[:, :, :used])
    assert not q[:, :, used:].any()


def test_the_largest_numbers_come_back_and_larger_ones_are_refused() -> None:
    head = BlockHeader(30, 0, 0)
    q = np.zeros((CHANNEL_COUNT, 3, 2), dtype=np.int64)
    q[0, 0], q[18, 2] = ((1 << 19) - 2, -(1 << 18)), (-5, 1 << 17)
    np.testing.assert_array_equal(
        coefficients.decode_coefficients(PRIOR, coefficients.encode_coefficients(PRIOR, head, q, 30, FPS), 30, FPS)[1],
        q,
    )
    q[18, 2, 1] = 1 << 40
    with pytest.raises(ValueError, match="too large"):
        coefficients.encode_coefficients(PRIOR, head, q, 30, FPS)


def test_head_and_end_cost_few_bytes() -> None:
    q = np.zeros((CHANNEL_COUNT, 3, 30), dtype=np.int64)
    assert len(coefficients.encode_coefficients(PRIOR, BlockHeader(30, 200, -32), q, 30, FPS)) <= 6
    assert len(coefficients.encode_coefficients(PRIOR, BlockHeader(499, 200, -32), q, 30, FPS)) <= 9
    assert len(coefficients.encode_coefficients(PRIOR, BlockHeader(30, 200, 0), q[:SCENE_CHANNEL_COUNT], 30, FPS)) <= 3


@given(st.binary(max_size=300), st.integers(1, 120))
def test_any_bytes_decode_or_are_refused(data: bytes, usual: int) -> None:
    try:
        head, q = coefficients.decode_coefficients(PRIOR, data, usual, FPS)
    except DamagedBlock:
        return
    assert q.shape[2] <= head.frames <= 512
    assert abs(q).max(initial=0) < 1 << 36


def test_too_many_bytes_are_refused() -> None:
    with pytest.raises(DamagedBlock, match="bytes"):
        coefficients.decode_coefficients(PRIOR, bytes(MAX_BLOCK_BYTES + 1), 30, FPS)
