"""Other solvers for comparison: scipy here, three.js and closed-chain-ik in Node, warmed up, on the same targets."""

from __future__ import annotations

import base64
import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from math import atan2, hypot
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from scipy.optimize import minimize

from bunraku.marionette import bend_table
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

WEB = Path(__file__).resolve().parents[2] / "services/web"


def processor_rate(solve: Callable[[], int]) -> float:
    """Return how many arms `solve` solves per second of CPU time, which other processes do not affect."""
    began = time.process_time()
    count = solve()
    return count / (time.process_time() - began)


class SlsqpSolver:
    """SLSQP of scipy: minimises the paper's E with the tip on its target, starting from the previous arm.

    Gradients are provided and joints have no limits, which saves a third of its time.
    """

    def __init__(self, proportions: Proportions) -> None:
        self._links = np.array(proportions.lengths)
        m0, m1, m2 = proportions.masses
        self._weights = self._links * np.array([m0 / 2.0 + m1 + m2, m1 / 2.0 + m2, m2 / 2.0])
        self.angles = np.array([-1.2, -0.6, 0.0])

    def solve(self, targets: Array) -> int:
        """Solve for `targets` (n, 3) one after the other and return `n`."""
        for x, y, z in targets.tolist():
            self.reach(hypot(x, z), y)
        return len(targets)

    def mean_tip_error(self, targets: Array) -> float:
        """Return the mean distance of tips from `targets` (n, 3)."""
        return float(np.mean([self.reach(hypot(x, z), y) for x, y, z in targets.tolist()]))

    def reach(self, level: float, up: float) -> float:
        """Solve for one target in the plane and return the distance of the tip from it."""
        links, weights = self._links, self._weights

        def tip_offset(angles: Array) -> Array:
            return np.array([links @ np.cos(angles) - level, links @ np.sin(angles) - up])

        found = minimize(
            lambda angles: float(weights @ np.sin(angles)),
            self.angles,
            jac=lambda angles: weights * np.cos(angles),
            method="SLSQP",
            constraints={
                "type": "eq",
                "fun": tip_offset,
                "jac": lambda t: np.array([-links * np.sin(t), links * np.cos(t)]),
            },
        )
        if found.success:
            self.angles = found.x
        else:
            # from a pose it cannot leave it would fail for ever
            self.angles = atan2(up, level) + np.array([-1.0, 0.3, 0.8])
        return float(np.linalg.norm(tip_offset(self.angles)))


class NodeProcess:
    """The script of the web client's bench, bundled once: `with Node() as node: node.round(...)`."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._script = str(Path(self._folder.name) / "ik.mjs")

    def __enter__(self) -> Self:
        bundle = [
            "npx",
            "rolldown",
            "tests/bench/ik.ts",
            "--file",
            self._script,
            "--platform",
            "node",
            "--format",
            "esm",
        ]
        subprocess.run(bundle, cwd=WEB, capture_output=True, timeout=120, check=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._folder.cleanup()

    def run_round(self, bodies: list[tuple[Proportions, Array]], orders: dict[str, Array]) -> dict[str, Any]:
        """One round: `orders`, for each its `rates` (solves a second, by solver and turn) and mean tip `errors`; and
        `solved`, what TypeScript makes of each body's targets (n, 3)."""
        asked = {
            "bodies": [
                {
                    "proportions": proportions.identity,
                    "table": base64.b64encode(
                        bend_table.pack_bend_table(bend_table.load_bend_table(proportions.identity))
                    ).decode(),
                    "checked": targets.ravel().tolist(),
                }
                for proportions, targets in bodies
            ],
            "orders": {order: targets.ravel().tolist() for order, targets in orders.items()},
        }
        done = subprocess.run(
            ["node", self._script], input=json.dumps(asked), capture_output=True, text=True, timeout=300, check=True
        )
        answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
        return answer
