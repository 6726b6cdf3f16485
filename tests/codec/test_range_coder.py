from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec._kernels.range_coder import (
    HALF_PROBABILITY,
    decode_bit,
    encode_bit,
    finish_encoder,
    start_decoder,
    start_encoder,
)

BITS = st.lists(st.tuples(st.integers(0, 1), st.integers(64, 32704)), max_size=400)


def encode_bits(bits: list[tuple[int, int]]) -> bytes:
    state, out = start_encoder(), np.zeros(4096, dtype=np.uint8)
    for bit, probability in bits:
        encode_bit(state, out, probability, bit)
    return out[1 : finish_encoder(state, out)].tobytes().rstrip(b"\0")


@given(BITS)
def test_bits_round_trip(bits: list[tuple[int, int]]) -> None:
    data = np.array(bytearray(encode_bits(bits)), dtype=np.uint8)
    state = start_decoder(data)
    assert [decode_bit(state, data, probability) for _, probability in bits] == [bit for bit, _ in bits]


def test_carry_propagates_through_pending_bytes() -> None:
    # improbable zeros push LOW towards the top of the range, where carries occur
    bits = [(0, 32704)] * 40 + [(1, 64)] * 3 + [(0, 32704)] * 40
    data = np.array(bytearray(encode_bits(bits)), dtype=np.uint8)
    state = start_decoder(data)
    assert [decode_bit(state, data, probability) for _, probability in bits] == [bit for bit, _ in bits]


def test_coded_size_is_close_to_the_entropy() -> None:
    random = np.random.default_rng(3)
    bits = [(int(random.random() < 0.05), round(0.05 * 32768)) for _ in range(10_000)]
    entropy = -(0.05 * np.log2(0.05) + 0.95 * np.log2(0.95)) * 10_000 / 8
    assert len(encode_bits(bits)) < 1.1 * entropy


def test_predicted_bits_are_nearly_free_and_random_bits_cost_one() -> None:
    assert len(encode_bits([(1, 32704)] * 1000)) <= 4
    assert len(encode_bits([(i & 1, HALF_PROBABILITY) for i in range(800)])) <= 101
