"""Check of many seeds. Two test files share them, so that two processes run them side by side."""

from __future__ import annotations

import os

from tests.simulation.simulation import simulate

SEEDS = int(os.environ.get("BUNRAKU_SIMULATION_SEEDS", "200"))
"""Number of seeds; `make test-nightly` sets more."""
SEEDS_PER_TEST = 10


def first_seeds(half: int) -> range:
    """Return the first seed of each test in one half of the tests, 0 or 1."""
    return range(half * SEEDS_PER_TEST, SEEDS, 2 * SEEDS_PER_TEST)


def check_seeds(first: int) -> None:
    """Simulate `SEEDS_PER_TEST` seeds; raise AssertionError with those that violate an invariant."""
    found = []
    for seed in range(first, min(first + SEEDS_PER_TEST, SEEDS)):
        violation = simulate(seed).violation
        if violation is not None:
            found.append(f"seed {seed}: {violation}\n    replay: python -m tests.simulation --seed {seed}")
    assert not found, "\n".join(found)
