from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import coefficients
from bunraku.codec.channel_layout import create_layout
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.step_search import encode_channels
from bunraku.codec.timing import Timing
from bunraku.codec.transform import inverse_dct

LAYOUT = create_layout([11, 12], [-1, 0], [-1, 0])
TIMING = Timing(30.0, 30, 30, 30)


@pytest.mark.parametrize("bound_mm", [50.0, 5.0, 0.2])
def test_every_candidate_is_within_the_bound(bound_mm: float) -> None:
    t = np.arange(30)[:, None, None] / 30
    truth = 0.1 * np.sin(2 * np.pi * t * [[1, 2, 3], [2, 1, 0.5]])
    blocks = encode_channels(truth, bound_mm, TIMING, LAYOUT, load_shipped_prior())
    assert blocks
    for data in blocks:
        header, q = coefficients.decode_coefficients(load_shipped_prior(), data, 30, 30.0, LAYOUT)
        decoded = inverse_dct(reconstruct(q) * step_size(header.step, 30), 30, np.arange(30.0))
        assert np.linalg.norm(decoded - truth, axis=-1).max() * 1e3 <= bound_mm


def test_bound_that_no_step_meets_gives_no_block() -> None:
    noise = np.random.default_rng(1).normal(0, 100, (30, 2, 3))
    assert encode_channels(noise, 1e-9, TIMING, LAYOUT, load_shipped_prior()) == []
