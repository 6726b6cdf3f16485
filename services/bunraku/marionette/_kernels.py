"""Compiled solvers of limbs and arms.

Load this module with `bunraku.kernels.load_kernels("marionette")`: importing numba takes seconds. The functions are
those of the plain solver, compiled as they stand together with the functions of this package that they call, and they
return the same numbers to the last bit. `solve_arms` agrees with `arm_batch.solve_arms` within rounding.
"""

from __future__ import annotations

from functools import cache
from math import inf
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import config, njit

from bunraku.marionette import arm_batch
from bunraku.marionette.arm import BendTable
from bunraku.marionette.arm_batch import ArmConstants, SolvedArms, arm_constants
from bunraku.marionette.limb_rig import BEND_AXIS, UP, ArmRig, Limb
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import ElbowState
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.twist_step import NO_TWIST_LAG
from bunraku.marionette.solver.vector import ZERO
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import standard_figure

# inlined: returning eleven numbers would take as long as solving
_solve_tip = njit(error_model="numpy", inline="always")(arm_batch.solve_tip)


@cache
def compile_solver(cache_folder: str | None = None) -> LimbSolver:
    """Return the compiled solver. Takes seconds, the first time more: call it in a thread, one call at a time.

    `cache_folder` keeps the compiled code for the next process. It must be a folder for exactly these sources: numba
    itself checks the date of one file only and would miss a change in a called function. The cache folder is a setting
    of the whole process, which is why calls must not overlap.
    """
    previous = config.CACHE_DIR  # type: ignore[attr-defined]
    compiled: dict[object, Any] = {}
    try:
        if cache_folder is not None:
            config.CACHE_DIR = cache_folder  # type: ignore[attr-defined]
        functions = [_compile(function, compiled) for function in PYTHON_SOLVER]
        if cache_folder is not None:
            for function in functions:
                function.enable_caching()
    finally:
        config.CACHE_DIR = previous  # type: ignore[attr-defined]
    solver = LimbSolver(*functions)
    _call_every_function(solver)
    for function in functions:
        # an argument of another type must raise, not make a stage wait for the compiler
        function.disable_compile()
    return solver


def _compile(function: Any, compiled: dict[object, Any]) -> Any:
    """Compile a function and the functions of this package that it calls; `compiled` holds those that are done."""
    if function in compiled:
        return compiled[function]
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        used = scope.get(name)
        if isinstance(used, FunctionType):
            scope[name] = _compile(used, compiled)
        elif isinstance(used, ModuleType) and used.__name__.startswith("bunraku."):
            module = compiled.setdefault(used, ModuleType(used.__name__))
            for attribute in function.__code__.co_names:
                if isinstance(called := vars(used).get(attribute), FunctionType):
                    setattr(module, attribute, _compile(called, compiled))
            scope[name] = module
    compiled[function] = njit(FunctionType(function.__code__, scope, function.__name__, function.__defaults__))
    return compiled[function]


def _call_every_function(solver: LimbSolver) -> None:
    """Call each function with the types that a stage uses, which compiles it or loads it from the cache."""
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        rig = ArmRig(standard_figure(), limb)
        state: ElbowState = (UP, BEND_AXIS, 0.3, ZERO)
        (tip, _, bend), _ = solver.step_elbow(
            rig.arm.geometry, rig.arm.bend_nodes, rig.shoulder, state, UP, 0.7, UP, 0.02
        )
        joints = solver.bend_links(rig.arm.geometry, rig.rest_frames, rig.palm_turn_rad, vector.length(tip), bend)
        solver.joint_positions(rig.bones, joints)
        solver.limit_twist(rig.bones, joints, NO_TWIST_LAG, joints, 1.0, 0.02)
    solver.advance(UP, ZERO, BEND_AXIS, ZERO, ZERO, ZERO, 0.02, 1.0, 0.0, inf)


@njit(error_model="numpy")
def _solve_rows(constants: ArmConstants, nodes: Array, targets: Array, solved: Array) -> None:
    for n in range(len(targets)):
        numbers = _solve_tip(constants, nodes, targets[n, 0], targets[n, 1], targets[n, 2])
        for row in range(11):
            solved[row, n] = numbers[row]


def solve_arms(proportions: Proportions, table: BendTable, targets: Array) -> SolvedArms:
    """Return the arms with their tips at `targets` (n, 3), in arm lengths with y up, as `arm_batch.solve_arms` does."""
    targets = np.ascontiguousarray(targets, dtype=np.float64)
    solved = np.empty((11, len(targets)))
    _solve_rows(arm_constants(proportions), table.astype(np.float64).ravel(), targets, solved)
    return SolvedArms(solved)
