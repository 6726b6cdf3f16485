"""What solves arms, compiled: thousands of pulled limbs a second on a stage, hundreds of thousands of arms at once.

A module of its own because importing numba takes seconds, and compiling a few more: who serves others meanwhile uses
the plain functions, which give the same numbers, those that `load` compiles to the last bit. The formulae are theirs: a
function is compiled as it stands, with all that it calls of this package.
"""

from __future__ import annotations

from math import inf
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import config, njit

from bunraku.marionette import arm_batch, elbow, follower, limb_rig, twist, vector
from bunraku.marionette.arm import BendTable
from bunraku.marionette.arm_batch import ArmConstants, SolvedArms, arm_constants
from bunraku.marionette.follower import ZERO_VELOCITY
from bunraku.marionette.limb_rig import BEND_AXIS, UP, ArmRig, Limb
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import standard_figure

COMPILED_FUNCTIONS = (
    (elbow, "step_elbow"),
    (follower, "advance"),
    (limb_rig, "bend_links"),
    (limb_rig, "joint_positions"),
    (twist, "limit_twist"),
)
"""What a pulled hand takes most of its time in: functions of numbers and plain tuples, by module and name."""
_PYTHON_FUNCTIONS = {(module, name): vars(module)[name] for module, name in COMPILED_FUNCTIONS}

# inlined: handing eleven numbers back would take as long as solving
_solve_tip = njit(error_model="numpy", inline="always")(arm_batch.solve_tip)


def enable(cache_directory: str | None = None) -> None:
    """From now on limbs are solved by compiled code. Best called in a thread: it takes seconds.

    With `cache`, a folder for these very sources and no others, what was compiled is kept there, and the next time
    takes a moment. (By itself numba looks at the date of one file, and would miss a change in what that one calls.)
    One at a time: where numba keeps things is a setting of the whole process.
    """
    before = config.CACHE_DIR  # type: ignore[attr-defined]
    done: dict[object, Any] = {}
    fast: dict[str, Any] = {}
    try:
        if cache_directory is not None:
            config.CACHE_DIR = cache_directory  # type: ignore[attr-defined]
        for module, name in COMPILED_FUNCTIONS:
            fast[name] = _compile(_PYTHON_FUNCTIONS[module, name], done)
            if cache_directory is not None:
                fast[name].enable_caching()
    finally:
        config.CACHE_DIR = before  # type: ignore[attr-defined]
    _compile_by_calling(fast)
    for module, name in COMPILED_FUNCTIONS:
        # what it was not compiled for would make a stage wait for the compiler
        fast[name].disable_compile()
        setattr(module, name, fast[name])


def disable() -> None:
    """From now on limbs are solved by plain Python again."""
    for module, name in COMPILED_FUNCTIONS:
        setattr(module, name, _PYTHON_FUNCTIONS[module, name])


def _compile(function: FunctionType, compiled_functions: dict[object, Any]) -> Any:
    """A function as it stands, what it calls of this package being compiled too; `done` are those that already are."""
    if function in compiled_functions:
        return compiled_functions[function]
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        used = scope.get(name)
        if isinstance(used, FunctionType):
            scope[name] = _compile(used, compiled_functions)
        elif isinstance(used, ModuleType) and used.__name__.startswith("bunraku."):
            module = compiled_functions.setdefault(used, ModuleType(used.__name__))
            for attribute in function.__code__.co_names:
                if isinstance(called := vars(used).get(attribute), FunctionType):
                    setattr(module, attribute, _compile(called, compiled_functions))
            scope[name] = module
    compiled_functions[function] = njit(
        FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    )
    return compiled_functions[function]


def _compile_by_calling(compiled_functions: dict[str, Any]) -> None:
    """Calls each function as stages do: with this it is compiled."""
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        rig = ArmRig(standard_figure(), limb)
        memory: elbow.ElbowState = (UP, BEND_AXIS, 0.3, ZERO_VELOCITY)
        (tip, _, bend), _ = compiled_functions["step_elbow"](
            rig.arm.geometry, rig.arm.bend_nodes, rig.shoulder, memory, UP, 0.7, UP, 0.02
        )
        joints = compiled_functions["bend_links"](
            rig.arm.geometry, rig.rest_frames, rig.palm_turn_rad, vector.length(tip), bend
        )
        compiled_functions["joint_positions"](rig.bones, joints)
        compiled_functions["limit_twist"](rig.bones, joints, twist.NO_TWIST_LAG, joints, 1.0, 0.02)
    compiled_functions["advance"](
        UP, ZERO_VELOCITY, BEND_AXIS, ZERO_VELOCITY, ZERO_VELOCITY, ZERO_VELOCITY, 0.02, 1.0, 0.0, inf
    )


@njit(error_model="numpy")
def _solve_rows(shape: ArmConstants, nodes: Array, targets: Array, solved: Array) -> None:
    for n in range(len(targets)):
        placed = _solve_tip(shape, nodes, targets[n, 0], targets[n, 1], targets[n, 2])
        for row in range(11):
            solved[row, n] = placed[row]


def solve_arms(proportions: Proportions, table: BendTable, targets: Array) -> SolvedArms:
    """As `arm_batch.solve`: the arms whose tips are at `targets` (n, 3), in arm lengths with y up."""
    targets = np.ascontiguousarray(targets, dtype=np.float64)
    solved = np.empty((11, len(targets)))
    _solve_rows(arm_constants(proportions), table.astype(np.float64).ravel(), targets, solved)
    return SolvedArms(solved)
