from __future__ import annotations

import json

import numpy as np
import pytest

from bunraku.codec import prior
from bunraku.codec.prior import FREQUENCY_CLASS_OF, MAGNITUDE_LEVELS, RELATIVE_CHANNELS, SHAPES, Prior
from bunraku.motion.skeleton import JOINTS


def test_levels_are_sixteen_log_2() -> None:
    np.testing.assert_array_equal(MAGNITUDE_LEVELS, np.round(16 * np.log2(1 + np.arange(4096))))


def test_relatives_are_coded_before_and_mirrors_are_the_other_side() -> None:
    channels = np.arange(19)
    assert (channels > RELATIVE_CHANNELS).all()
    channel = {name: index + 1 for index, name in enumerate(JOINTS)}
    parent, mirror, grandparent = RELATIVE_CHANNELS
    assert parent[channel["l_knee"]] == channel["l_hip"]
    assert mirror[channel["r_elbow"]] == channel["l_elbow"]
    assert mirror[channel["vl5"]] == channel["r_midtarsal"]
    assert grandparent[channel["l_wrist"]] == channel["l_shoulder"]


def test_classes_rise_with_the_frequency() -> None:
    assert FREQUENCY_CLASS_OF[[0, 1, 2, 3, 4, 5, 8, 9, 15, 16, 512]].tolist() == [0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6]


def test_the_shipped_prior_is_within_what_32_bits_can_add_up() -> None:
    shipped = prior.load_shipped_prior()
    for name, array in shipped._asdict().items():
        assert array.shape == getattr(SHAPES, name)
    assert max(abs(shipped.linear).max(), abs(shipped.hidden).max(), abs(shipped.out).max()) < 1 << 15
    for bias in (shipped.bias, shipped.hidden_bias, shipped.hidden_class):
        assert abs(bias).max() <= 1 << 22
    for odds in (shipped.hazard, shipped.sign):
        assert 0 < odds.min() <= odds.max() < 1 << 15


def test_a_prior_survives_its_json_and_wrong_shapes_are_refused() -> None:
    shipped = prior.load_shipped_prior()
    values = json.loads(prior.format_prior(shipped))
    for ours, again in zip(shipped, prior.parse_prior(values), strict=True):
        np.testing.assert_array_equal(ours, again)
    with pytest.raises(ValueError, match="hazard"):
        prior.parse_prior(values | {"hazard": [[1, 2]]})
    assert set(values) == set(Prior._fields)
