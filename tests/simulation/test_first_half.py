"""Simulations of the first half of all seeds; `tests/simulation/__main__.py` replays one."""

from __future__ import annotations

import pytest

from tests.simulation.seed_check import check_seeds, first_seeds


@pytest.mark.parametrize("first", first_seeds(0))
def test_invariants_hold(first: int) -> None:
    check_seeds(first)
