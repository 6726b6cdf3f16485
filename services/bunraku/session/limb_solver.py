"""Compiled solver of limbs, loaded once per process."""

from __future__ import annotations

from threading import Lock

from bunraku.kernels import load_kernels
from bunraku.marionette.solver.limb_solver import LimbSolver
from bunraku.runtime.compile_cache import compile_cache_folder

_load_lock = Lock()


def load_compiled_solver() -> LimbSolver:
    """Load the compiled solver, or compile it the first time; takes seconds.

    Call it in a thread. Servers of one process may call it at the same time.
    """
    with _load_lock:
        solver: LimbSolver = load_kernels("marionette").compile_solver(compile_cache_folder("marionette"))
    return solver
