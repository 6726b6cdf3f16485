from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import coefficients, prior
from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.coefficients import MAX_BLOCK_BYTES, BlockHeader
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import IntArray
from bunraku.codec.scene import SCENE_CHANNEL_COUNT
from bunraku.motion.skeleton import CHANNEL_COUNT

PRIOR = prior.load_shipped_prior()
FPS = 30.0


def random_coefficients(seed: int, count: int, magnitude: float) -> IntArray:
    random = np.random.default_rng(seed)
    spectrum = magnitude / (1 + np.arange(count)) ** 1.5
    return np.round(random.laplace(0, 1, (CHANNEL_COUNT, 3, count)) * spectrum).astype(np.int64)


@given(
    st.integers(0, 1000),
    st.integers(1, 60),
    st.floats(0, 20_000),
    st.builds(BlockHeader, st.integers(60, 512), st.integers(0, 255), st.integers(-32, 31)),
    st.sampled_from([60, 30]),
)
def test_header_and_coefficients_round_trip(
    seed: int, count: int, magnitude: float, header: BlockHeader, nominal_frames: int
) -> None:
    q = random_coefficients(seed, count, magnitude)
    data = coefficients.encode_coefficients(PRIOR, header, q, nominal_frames, FPS)
    decoded_header, decoded = coefficients.decode_coefficients(PRIOR, data, nominal_frames, FPS)
    assert decoded_header == header
    used = decoded.shape[2]
    np.testing.assert_array_equal(decoded, q[:, :, :used])
    assert not q[:, :, used:].any()


@given(st.integers(0, 1000), st.integers(1, 60), st.floats(0, 20_000), st.integers(60, 512), st.integers(0, 255))
def test_scene_block_round_trips(seed: int, count: int, magnitude: float, frames: int, step: int) -> None:
    q = random_coefficients(seed, count, magnitude)[:SCENE_CHANNEL_COUNT]
    q[2, 1:] = 0
    header = BlockHeader(frames, step, 0)
    data = coefficients.encode_coefficients(PRIOR, header, q, 60, FPS, SCENE_LAYOUT)
    decoded_header, decoded = coefficients.decode_coefficients(PRIOR, data, 60, FPS, SCENE_LAYOUT)
    assert decoded_header == header
    used = decoded.shape[2]
    np.testing.assert_array_equal(decoded, q[:, :, :used])
    assert not q[:, :, used:].any()


def test_largest_coefficients_round_trip_and_larger_ones_are_refused() -> None:
    header = BlockHeader(30, 0, 0)
    q = np.zeros((CHANNEL_COUNT, 3, 2), dtype=np.int64)
    q[0, 0], q[18, 2] = ((1 << 19) - 2, -(1 << 18)), (-5, 1 << 17)
    data = coefficients.encode_coefficients(PRIOR, header, q, 30, FPS)
    np.testing.assert_array_equal(coefficients.decode_coefficients(PRIOR, data, 30, FPS)[1], q)
    q[18, 2, 1] = 1 << 40
    with pytest.raises(ValueError, match="too large"):
        coefficients.encode_coefficients(PRIOR, header, q, 30, FPS)


def test_block_of_zeros_costs_few_bytes() -> None:
    q = np.zeros((CHANNEL_COUNT, 3, 30), dtype=np.int64)
    assert len(coefficients.encode_coefficients(PRIOR, BlockHeader(30, 200, -32), q, 30, FPS)) <= 6
    assert len(coefficients.encode_coefficients(PRIOR, BlockHeader(499, 200, -32), q, 30, FPS)) <= 9
    assert (
        len(
            coefficients.encode_coefficients(
                PRIOR, BlockHeader(30, 200, 0), q[:SCENE_CHANNEL_COUNT], 30, FPS, SCENE_LAYOUT
            )
        )
        <= 3
    )


@given(st.binary(max_size=300), st.integers(1, 120))
def test_arbitrary_bytes_are_decoded_or_refused(data: bytes, nominal_frames: int) -> None:
    try:
        header, q = coefficients.decode_coefficients(PRIOR, data, nominal_frames, FPS)
    except DamagedBlock:
        return
    assert q.shape[2] <= header.frames <= 512
    assert abs(q).max(initial=0) < 1 << 36


def test_too_long_block_is_refused() -> None:
    with pytest.raises(DamagedBlock, match="bytes"):
        coefficients.decode_coefficients(PRIOR, bytes(MAX_BLOCK_BYTES + 1), 30, FPS)
