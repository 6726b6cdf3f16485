"""Replay of one simulation: `python -m tests.simulation --seed N` prints its trace."""

from __future__ import annotations

import argparse
import sys
import time

from tests.simulation.simulation import simulate


def main() -> int:
    """Run the seeds of the command line; return 1 if an invariant is violated."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulation", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--count", type=int, default=1, help="number of seeds; several are listed without their traces")
    arguments = parser.parse_args()
    failed = 0
    for seed in range(arguments.seed, arguments.seed + arguments.count):
        started = time.perf_counter()
        outcome = simulate(seed)
        if arguments.count == 1:
            print("\n".join(outcome.trace))
        duration = time.perf_counter() - started
        print(
            f"seed {seed}: {outcome.violation or 'no violation'} ({outcome.virtual_us * 1e-6:.1f} s of virtual time, "
            f"{outcome.steps} steps, {duration:.2f} s)",
            flush=True,
        )
        failed += outcome.violation is not None
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
