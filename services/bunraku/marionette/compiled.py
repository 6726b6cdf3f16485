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

from bunraku.marionette import arms, elbow, follow, limbs, spin, vector
from bunraku.marionette.arm import Table
from bunraku.marionette.arms import Arms, Shape, shape_of
from bunraku.marionette.follow import STILL
from bunraku.marionette.limbs import BEND_AXIS, UP, ArmRig, Limb
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import standard_figure

SOLVING = ((elbow, "hang"), (follow, "advance"), (limbs, "bend_links"), (limbs, "places"), (spin, "turn"))
"""What a pulled hand takes most of its time in: functions of numbers and plain tuples, by module and name."""
_PLAIN = {(module, name): vars(module)[name] for module, name in SOLVING}

# inlined: handing eleven numbers back would take as long as solving
_place = njit(error_model="numpy", inline="always")(arms.place)


def load(cache: str | None = None) -> None:
    """From now on limbs are solved by compiled code. Best called in a thread: it takes seconds.

    With `cache`, a folder for these very sources and no others, what was compiled is kept there, and the next time
    takes a moment. (By itself numba looks at the date of one file, and would miss a change in what that one calls.)
    One at a time: where numba keeps things is a setting of the whole process.
    """
    before = config.CACHE_DIR  # type: ignore[attr-defined]
    done: dict[object, Any] = {}
    fast: dict[str, Any] = {}
    try:
        if cache is not None:
            config.CACHE_DIR = cache  # type: ignore[attr-defined]
        for module, name in SOLVING:
            fast[name] = _compiled(_PLAIN[module, name], done)
            if cache is not None:
                fast[name].enable_caching()
    finally:
        config.CACHE_DIR = before  # type: ignore[attr-defined]
    _call(fast)
    for module, name in SOLVING:
        # what it was not compiled for would make a stage wait for the compiler
        fast[name].disable_compile()
        setattr(module, name, fast[name])


def unload() -> None:
    """From now on limbs are solved by plain Python again."""
    for module, name in SOLVING:
        setattr(module, name, _PLAIN[module, name])


def _compiled(function: FunctionType, done: dict[object, Any]) -> Any:
    """A function as it stands, what it calls of this package being compiled too; `done` are those that already are."""
    if function in done:
        return done[function]
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        used = scope.get(name)
        if isinstance(used, FunctionType):
            scope[name] = _compiled(used, done)
        elif isinstance(used, ModuleType) and used.__name__.startswith("bunraku."):
            module = done.setdefault(used, ModuleType(used.__name__))
            for attribute in function.__code__.co_names:
                if isinstance(called := vars(used).get(attribute), FunctionType):
                    setattr(module, attribute, _compiled(called, done))
            scope[name] = module
    done[function] = njit(FunctionType(function.__code__, scope, function.__name__, function.__defaults__))
    return done[function]


def _call(fast: dict[str, Any]) -> None:
    """Calls each function as stages do: with this it is compiled."""
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        rig = ArmRig(standard_figure(), limb)
        memory: elbow.Memory = (UP, BEND_AXIS, 0.3, STILL)
        (tip, _, bend), _ = fast["hang"](rig.arm.links, rig.arm.nodes, rig.shoulder, memory, UP, 0.7, UP, 0.02)
        joints = fast["bend_links"](rig.arm.links, rig.frames, rig.palm_down, vector.length(tip), bend)
        fast["places"](rig.links, joints)
        fast["turn"](rig.links, joints, spin.AT_REST, joints, 1.0, 0.02)
    fast["advance"](UP, STILL, BEND_AXIS, STILL, STILL, STILL, 0.02, 1.0, 0.0, inf)


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
