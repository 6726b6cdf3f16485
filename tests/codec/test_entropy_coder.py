from __future__ import annotations

import numpy as np

from bunraku.codec import prior
from bunraku.codec._kernels import entropy_coder
from bunraku.codec.channel_layout import MOTION_LAYOUT
from bunraku.codec.prior import FEATURE_COUNT

PRIOR = prior.load_shipped_prior()


def test_bit_length() -> None:
    assert [entropy_coder.bit_length(value) for value in (0, 1, 2, 3, 4, 1000)] == [0, 1, 2, 2, 3, 10]


def test_examples_contain_every_coefficient_in_coding_order() -> None:
    random = np.random.default_rng(3)
    q = random.integers(-3, 4, (19, 3, 6))
    header = np.array([30, 120, 0, 6, 19], dtype=np.int64)
    features, labels = entropy_coder.collect_examples(PRIOR, MOTION_LAYOUT, q, header, 64)
    assert features.shape == (q.size, FEATURE_COUNT)
    np.testing.assert_array_equal(labels[:, 2], abs(q).transpose(0, 2, 1).ravel())
    np.testing.assert_array_equal(labels[:, 3], np.select([q > 0, q < 0], [1, 2]).transpose(0, 2, 1).ravel())
    assert (features[:, 22] == 120).all()


def test_invalid_header_is_reported() -> None:
    header = np.zeros(5, dtype=np.int64)
    # zeros always take the lower part: 30 frames, and all bits of the number of frequencies set
    assert not entropy_coder.decode_header(np.zeros(9, dtype=np.uint8), MOTION_LAYOUT, 30, header)
    assert header[entropy_coder.HEADER_FREQUENCIES] == 31
