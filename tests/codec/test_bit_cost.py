from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import bit_cost, coefficients, prior
from bunraku.codec.coefficients import BlockHeader

PRIOR = prior.load_shipped_prior()
COST_TABLE = bit_cost.build_cost_table(PRIOR)


@pytest.mark.parametrize("scaled", [-1792, -300, 0, 700, 1500, 3584])
def test_larger_than_expected_costs_more(scaled: int) -> None:
    expected = max(1, round(2 ** (scaled / 256)))
    found = [bit_cost.coefficient_bits(COST_TABLE, 3, scaled, expected * by) for by in (2, 8, 64, 1024)]
    assert found == sorted(found)


def test_costs_are_those_of_the_coder() -> None:
    # one coefficient alone in a block: all others are zeros that cost the same with and without it
    for size in (1, 3, 17, 18, 40, 5000):
        sizes = []
        for count in (0, 400):
            q = np.zeros((19, 3, 40), dtype=np.int64)
            q[5, 1, 39] = 1
            q[18, 2, 39 - count // 400] = size if count else 0
            sizes.append(len(coefficients.encode_coefficients(PRIOR, BlockHeader(40, 120, 0), q, 40, 30.0)) * 8)
        assert sizes[1] - sizes[0] < bit_cost.coefficient_bits(COST_TABLE, 6, -1792, size) + 40
