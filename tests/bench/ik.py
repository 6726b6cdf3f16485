"""Accuracy and speed of the arm solver, compared with other solvers: `make bench-ik`.

The last line printed is one JSON object. Rates are arms per second of CPU time on one core. Solvers alternate, and
ratios are computed between solvers of one language in one round: TypeScript against CCDIKSolver of three.js and
closed-chain-ik, Python against SLSQP of scipy. Targets come in two orders: `jumps`, uniform over the reach of the arm,
each far from the one before; and `path`, a hand that moves at half an arm length per second at 60 Hz, which saves
most of the work of solvers that start from the previous pose. Figures without `path` in their names are for `jumps`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from math import pi
from statistics import median
from typing import Any

import numpy as np

from bunraku.kernels import load_kernels
from bunraku.marionette import arm_batch, bend_table
from bunraku.marionette.arm import BendTable
from bunraku.marionette.arm_batch import SolvedArms
from bunraku.marionette.bodies import BODIES
from bunraku.marionette.constants import MAX_TIP_DISTANCE
from bunraku.marionette.paper import PAPER_BYTES
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array
from tests.bench import ik_accuracy, smoothness
from tests.bench.ik_peers import NodeProcess, SlsqpSolver, processor_rate

ROUND_COUNT = 5
TARGET_COUNT = 20_000
ACCURACY_TARGET_COUNT = 10_000
SLSQP_TARGET_COUNT = 300
EDGE_CASE_TARGETS = (
    (0.0, -0.7, 0.0),
    (0.0, 0.7, 0.0),
    (0.0, 0.0, 0.0),
    (2.0, 0.0, 0.0),
    (0.01, 0.0, -0.01),
    (-0.3, -1.4, -0.2),
)
"""Straight below and above, at the shoulder, out of reach, too near, beyond the reach."""


def wandering_targets(proportions: Proportions, count: int) -> Array:
    """Return positions (count, 3) of a moving hand at 60 Hz, on average half an arm length per second."""
    t = np.arange(count) / 60.0
    inner = proportions.min_tip_distance
    r = 0.5 * (inner + MAX_TIP_DISTANCE) + 0.48 * (MAX_TIP_DISTANCE - inner) * np.sin(0.83 * t) * np.cos(0.11 * t)
    beta, azimuth = 0.45 * pi * np.sin(0.57 * t + 2.0) * np.cos(0.05 * t), 2.2 * np.sin(0.36 * t) + np.sin(0.97 * t)
    level = r * np.cos(beta)
    return np.stack([level * np.sin(azimuth), r * np.sin(beta), level * np.cos(azimuth)], axis=-1)


def measure_accuracy(random: np.random.Generator) -> dict[str, float]:
    """Measure the accuracy for all bodies and return the worst figures; prints a row for each body.

    Each body is measured with its proportions rounded to ten-thousandths, as its table has them, and exactly, with the
    bends of the nearest table."""
    print(f"{'body':<22}{'tip max':>10}{'angles mean':>13}{'p99':>8}{'max':>7} deg{'paper: mean':>14}{'max':>7} %")
    figures: dict[str, float] = {}
    for suffix, adjust in (("", Proportions.rounded), ("_nearest_table", lambda proportions: proportions)):
        for body in BODIES:
            proportions = adjust(body.proportions)
            stored = bend_table.load_bend_table(proportions.identity)
            found = ik_accuracy.measure_accuracy(proportions, stored, ACCURACY_TARGET_COUNT, random)
            paper = f"{100.0 * found.paper_tip_mean:18.4f}{100.0 * found.paper_tip_max:7.3f}"
            print(
                f"{body.name + suffix.replace('_', ' '):<22}{found.tip_error_max:10.1e}"
                f"{found.angle_error_mean_deg:13.4f}{found.angle_error_p99_deg:8.3f}{found.angle_error_max_deg:7.2f}"
                f"{paper}",
                flush=True,
            )
            for name, value in found._asdict().items():
                # the tips and the paper's figures are the same in both cases
                if not suffix or name.startswith("angle"):
                    figures[name + suffix] = max(figures.get(name + suffix, 0.0), value)
    return figures


def max_language_difference(bodies: list[tuple[Proportions, Array]], solved: list[Any]) -> float:
    """Return the maximum difference of positions and angles between the two languages."""
    max_difference = 0.0
    for (proportions, targets), rows in zip(bodies, solved, strict=True):
        python_result = arm_batch.solve_arms(proportions, bend_table.load_bend_table(proportions.identity), targets)
        max_difference = max(
            max_difference,
            float(
                np.abs(np.concatenate([python_result.rows, np.array(python_result.angles())]).T - np.array(rows)).max()
            ),
        )
    return max_difference


def measure_speeds(random: np.random.Generator) -> dict[str, float]:
    """Measure the rates of all solvers in both orders, and the difference between the languages."""
    # rounded as in their identities: TypeScript has no others
    shapes = [body.proportions.rounded() for body in BODIES]
    proportions = shapes[-1]
    stored = bend_table.load_bend_table(proportions.identity)
    orders = {
        "jumps": ik_accuracy.random_reachable_targets(proportions, TARGET_COUNT, random),
        "path": wandering_targets(proportions, TARGET_COUNT),
    }
    bodies = [
        (adjust, np.concatenate([EDGE_CASE_TARGETS, ik_accuracy.random_reachable_targets(adjust, 1000, random)]))
        for adjust in shapes
    ]
    slsqp = SlsqpSolver(proportions)

    def batches(solve: Callable[[Proportions, BendTable, Array], SolvedArms], targets: Array) -> float:
        return processor_rate(lambda: sum(len(solve(proportions, stored, targets).tip) for _ in range(20)))

    compiled_solve_arms = load_kernels("marionette").solve_arms
    compiled_solve_arms(proportions, stored, orders["jumps"])
    rates: dict[str, dict[str, list[float]]] = {order: {} for order in orders}
    errors: dict[str, dict[str, float]] = {}
    with NodeProcess() as node:
        for nth in range(ROUND_COUNT):
            answer = node.run_round(bodies, orders)
            for order, targets in orders.items():
                errors[order] = answer["orders"][order]["errors"] | {
                    "slsqp": slsqp.mean_tip_error(targets[:SLSQP_TARGET_COUNT])
                }
                found = {name: median(rounds) for name, rounds in answer["orders"][order]["rates"].items()}
                found["numpy"], found["compiled"] = (
                    batches(arm_batch.solve_arms, targets),
                    batches(compiled_solve_arms, targets),
                )
                slsqp_targets = targets[nth * SLSQP_TARGET_COUNT : (nth + 1) * SLSQP_TARGET_COUNT]
                found["slsqp"] = processor_rate(partial(slsqp.solve, slsqp_targets))
                for name, rate in found.items():
                    rates[order].setdefault(name, []).append(rate)
    return report_speeds(rates, errors) | {"languages_differ_max": max_language_difference(bodies, answer["solved"])}


def report_speeds(rates: dict[str, dict[str, list[float]]], errors: dict[str, dict[str, float]]) -> dict[str, float]:
    """Print the table of solvers and return its figures."""
    figures = {}
    for order, found in rates.items():
        print(f"\n{order:<26}{'solves/s':>12}{'python_result is':>10}{'tip off by':>12}")
        suffix = "" if order == "jumps" else f"_{order}"
        for name, base, key in (
            ("ours", "ours", "typescript"),
            ("ccdik_10", "ours", "ccdik_10"),
            ("ccdik_10_with_limits", "ours", "ccdik_10_with_limits"),
            ("closed_chain_ik", "ours", "closed_chain_ik"),
            ("compiled", "compiled", "python"),
            ("numpy", "compiled", "numpy"),
            ("slsqp", "compiled", "slsqp"),
        ):
            ratio = median(
                python_result / theirs for python_result, theirs in zip(found[base], found[name], strict=True)
            )
            figures[f"solves_per_s_{key}{suffix}"] = median(found[name])
            if name != base and name != "numpy":
                figures[f"times_{key}{suffix}"] = ratio
            off = f"{errors[order][name]:12.0e}" if name in errors[order] else ""
            print(f"{key:<26}{median(found[name]):12,.0f}{ratio:10,.0f}{off}", flush=True)
    return figures


def main() -> None:
    random = np.random.default_rng(18)
    figures = measure_accuracy(random)
    figures |= {"table_bytes": bend_table.TABLE_BYTES, "paper_table_bytes": PAPER_BYTES}
    figures |= measure_speeds(random)
    figures |= smoothness.measure_smoothness()
    print()
    print(
        json.dumps(
            {name: value if isinstance(value, int) else float(f"{value:.4g}") for name, value in figures.items()}
        )
    )


if __name__ == "__main__":
    main()
