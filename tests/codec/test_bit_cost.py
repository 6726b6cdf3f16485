from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import coefficients, prior
from bunraku.codec._kernels import bit_cost
from bunraku.codec.coefficients import BlockHeader

PRIOR = prior.load_shipped_prior()
COSTS = bit_cost.build_cost_table(PRIOR)


@pytest.mark.parametrize("scale", [-1792, -300, 0, 700, 1500, 3584])
def test_magnitude_above_the_prediction_costs_more(scale: int) -> None:
    expected = max(1, round(2 ** (scale / 256)))
    bits = [bit_cost.coefficient_bits(COSTS, 3, scale, expected * factor) for factor in (2, 8, 64, 1024)]
    assert bits == sorted(bits)


def test_estimate_is_close_to_the_coded_size() -> None:
    # a single additional coefficient: all others are zeros that cost the same with and without it
    for magnitude in (1, 3, 17, 18, 40, 5000):
        coded_bits = []
        for last, value in ((39, 0), (38, magnitude)):
            q = np.zeros((19, 3, 40), dtype=np.int64)
            q[5, 1, 39] = 1
            q[18, 2, last] = value
            coded_bits.append(len(coefficients.encode_coefficients(PRIOR, BlockHeader(40, 120, 0), q, 40, 30.0)) * 8)
        assert coded_bits[1] - coded_bits[0] < bit_cost.coefficient_bits(COSTS, 6, -1792, magnitude) + 40
