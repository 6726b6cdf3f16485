from __future__ import annotations

import json

import numpy as np
import pytest

from bunraku.codec import prior
from bunraku.codec.prior import FREQUENCY_CLASS_OF, MAGNITUDE_LEVELS, RELATIVE_CHANNELS, SHAPES, Prior
from bunraku.motion.skeleton import JOINTS


def test_magnitude_levels_are_16_log2() -> None:
    np.testing.assert_array_equal(MAGNITUDE_LEVELS, np.round(16 * np.log2(1 + np.arange(4096))))


def test_relative_channels_are_earlier_and_mirrors_are_on_the_left() -> None:
    channels = np.arange(19)
    assert (channels > RELATIVE_CHANNELS).all()
    channel = {name: index + 1 for index, name in enumerate(JOINTS)}
    parent, mirror, grandparent = RELATIVE_CHANNELS
    assert parent[channel["l_knee"]] == channel["l_hip"]
    assert mirror[channel["r_elbow"]] == channel["l_elbow"]
    assert mirror[channel["vl5"]] == channel["r_midtarsal"]
    assert grandparent[channel["l_wrist"]] == channel["l_shoulder"]


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
