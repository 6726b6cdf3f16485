from __future__ import annotations

import numpy as np

from bunraku.codec import entropy_coder, prior
from bunraku.codec.prior import FEATURE_COUNT

PRIOR = prior.load_shipped_prior()


def test_bit_length() -> None:
    assert [entropy_coder.bit_length(value) for value in (0, 1, 2, 3, 4, 1000)] == [0, 1, 2, 2, 3, 10]


def test_examples_have_every_coefficient_in_the_coder_s_order() -> None:
    random = np.random.default_rng(3)
    q = random.integers(-3, 4, (19, 3, 6))
    head = np.array([30, 120, 0, 6, 19], dtype=np.int64)
    features, where = np.zeros((q.size, FEATURE_COUNT), np.int64), np.zeros((q.size, 5), np.int64)
    assert entropy_coder.collect_examples(PRIOR, q, head, 64, features, where, 0) == q.size
    np.testing.assert_array_equal(where[:, 2], abs(q).transpose(0, 2, 1).ravel())
    np.testing.assert_array_equal(where[:, 3], np.select([q > 0, q < 0], [1, 2]).transpose(0, 2, 1).ravel())
    assert (features[:, 22] == 120).all()


def test_what_cannot_be_a_head_is_said() -> None:
    head = np.zeros(5, dtype=np.int64)
    # nothing but zeros takes the lower part always: 30 frames, all bits of the count set
    assert not entropy_coder.decode_header(np.zeros(9, dtype=np.uint8), 30, head)
    assert head[entropy_coder.HEADER_FREQUENCIES] == 31
