from __future__ import annotations

import json

import numpy as np
import pytest

from bunraku.codec import prior
from bunraku.codec.prior import FREQUENCY_CLASS_OF, MAGNITUDE_LEVELS, SHAPES, Prior


def test_magnitude_levels_are_16_log2() -> None:
    np.testing.assert_array_equal(MAGNITUDE_LEVELS, np.round(16 * np.log2(1 + np.arange(4096))))


def test_frequency_classes() -> None:
    assert FREQUENCY_CLASS_OF[[0, 1, 2, 3, 4, 5, 8, 9, 15, 16, 512]].tolist() == [0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6]


def test_shipped_prior_cannot_overflow_32_bits() -> None:
    shipped = prior.load_shipped_prior()
    for name, array in shipped._asdict().items():
        assert array.shape == getattr(SHAPES, name)
    assert max(abs(shipped.linear).max(), abs(shipped.hidden).max(), abs(shipped.out).max()) < 1 << 15
    for bias in (shipped.bias, shipped.hidden_bias, shipped.hidden_class):
        assert abs(bias).max() <= 1 << 22
    for probabilities in (shipped.hazard, shipped.sign):
        assert 0 < probabilities.min() <= probabilities.max() < 1 << 15


def test_prior_round_trips_through_json_and_wrong_shape_is_refused() -> None:
    shipped = prior.load_shipped_prior()
    values = json.loads(prior.format_prior(shipped))
    for array, parsed in zip(shipped, prior.parse_prior(values), strict=True):
        np.testing.assert_array_equal(array, parsed)
    with pytest.raises(ValueError, match="hazard"):
        prior.parse_prior(values | {"hazard": [[1, 2]]})
    assert set(values) == set(Prior._fields)
