from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import coefficients, costs, prior
from bunraku.codec.coefficients import Head

PRIOR = prior.shipped()
TABLE = costs.cost_table(PRIOR)


@pytest.mark.parametrize("scaled", [-1792, -300, 0, 700, 1500, 3584])
def test_larger_than_expected_costs_more(scaled: int) -> None:
    expected = max(1, round(2 ** (scaled / 256)))
    found = [costs.bits(TABLE, 3, scaled, expected * by) for by in (2, 8, 64, 1024)]
    assert found == sorted(found)


def test_costs_are_those_of_the_coder() -> None:
    # one coefficient alone in a block: all others are zeros that cost the same with and without it
    for size in (1, 3, 17, 18, 40, 5000):
        sizes = []
        for count in (0, 400):
            q = np.zeros((19, 3, 40), dtype=np.int64)
            q[5, 1, 39] = 1
            q[18, 2, 39 - count // 400] = size if count else 0
            sizes.append(len(coefficients.encode(PRIOR, Head(40, 120, 0), q, 40, 30.0)) * 8)
        assert sizes[1] - sizes[0] < costs.bits(TABLE, 6, -1792, size) + 40
