from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.allocation import select_cheapest


@given(st.integers(0, 10_000), st.integers(1, 4), st.integers(1, 4), st.floats(0, 1))
def test_selection_is_within_the_budget_and_near_the_optimum(
    seed: int, encodings: int, blocks: int, share: float
) -> None:
    random = np.random.default_rng(seed)
    errors = random.uniform(0.1, 2.0, (encodings, blocks))
    sizes = 50.0 / errors * random.uniform(0.8, 1.2, errors.shape)
    smallest = errors.min(axis=0).sum()
    budget = smallest + share * (errors.max(axis=0).sum() - smallest) + 1e-9
    selected = select_cheapest(sizes, errors, budget)
    columns = np.arange(blocks)
    assert errors[selected, columns].sum() <= budget
    combinations = [np.array(rows) for rows in product(range(encodings), repeat=blocks)]
    optimum = min(sizes[rows, columns].sum() for rows in combinations if errors[rows, columns].sum() <= budget)
    # at most one block is off the convex hull
    assert sizes[selected, columns].sum() <= optimum + sizes.max(axis=0).max()


def test_expensive_block_gets_more_of_the_error_budget() -> None:
    sizes = np.array([[1000.0, 100.0], [500.0, 90.0]])
    errors = np.array([[1.0, 1.0], [2.0, 2.0]])
    assert select_cheapest(sizes, errors, 3.0).tolist() == [1, 0]


def test_unreachable_budget_is_refused() -> None:
    with pytest.raises(ValueError, match="at least 2"):
        select_cheapest(np.ones((2, 2)), np.ones((2, 2)), 1.9)
