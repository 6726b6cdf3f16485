from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.allocation import select_cheapest


@given(st.integers(0, 10_000), st.integers(1, 4), st.integers(1, 4), st.floats(0, 1))
def test_it_keeps_the_budget_and_comes_near_the_best(seed: int, choices: int, blocks: int, share: float) -> None:
    random = np.random.default_rng(seed)
    errors = random.uniform(0.1, 2.0, (choices, blocks))
    sizes = 50.0 / errors * random.uniform(0.8, 1.2, errors.shape)
    least = errors.min(axis=0).sum()
    budget = least + share * (errors.max(axis=0).sum() - least) + 1e-9
    picked = select_cheapest(sizes, errors, budget)
    columns = np.arange(blocks)
    assert errors[picked, columns].sum() <= budget
    every = [np.array(rows) for rows in product(range(choices), repeat=blocks)]
    best = min(sizes[rows, columns].sum() for rows in every if errors[rows, columns].sum() <= budget)
    # at most one block is off the hull
    assert sizes[picked, columns].sum() <= best + sizes.max(axis=0).max()


def test_a_busy_block_may_err_more_than_a_calm_one() -> None:
    sizes = np.array([[1000.0, 100.0], [500.0, 90.0]])
    errors = np.array([[1.0, 1.0], [2.0, 2.0]])
    assert select_cheapest(sizes, errors, 3.0).tolist() == [1, 0]


def test_what_cannot_be_kept_is_said() -> None:
    with pytest.raises(ValueError, match="at least"):
        select_cheapest(np.ones((2, 2)), np.ones((2, 2)), 1.9)
