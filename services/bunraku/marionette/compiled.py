"""`arms.solve`, compiled: for hundreds of thousands of arms at once.

A module of its own because importing numba takes seconds, and compiling a few more: who serves others
meanwhile uses `arms.solve`, which gives the same numbers. The formulae are those of `arms.place`. Nothing is kept from
run to run: numba's cache looks at the date of one file alone, and would miss a change in that one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.marionette import arms
from bunraku.marionette.arm import Table
from bunraku.marionette.arms import Arms, Shape, shape_of
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

# inlined: handing eleven numbers back would take as long as solving
_place = njit(error_model="numpy", inline="always")(arms.place)


@njit(error_model="numpy")
def _solve(shape: Shape, nodes: Array, targets: Array, solved: Array) -> None:
    for n in range(len(targets)):
        placed = _place(shape, nodes, targets[n, 0], targets[n, 1], targets[n, 2])
        for row in range(11):
            solved[row, n] = placed[row]


def solve(proportions: Proportions, table: Table, targets: Array) -> Arms:
    """As `arms.solve`: the arms whose tips are at `targets` (n, 3), in arm lengths with y up."""
    targets = np.ascontiguousarray(targets, dtype=np.float64)
    solved = np.empty((11, len(targets)))
    _solve(shape_of(proportions), table.astype(np.float64).ravel(), targets, solved)
    return Arms(solved)
