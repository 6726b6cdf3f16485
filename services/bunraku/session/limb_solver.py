"""Compiled solver of limbs, loaded once per process."""

from __future__ import annotations

from pathlib import Path
from threading import Lock

from bunraku.kernels import load_kernels
from bunraku.marionette.solver.limb_solver import LimbSolver
from bunraku.runtime.compile_cache import compile_cache_folder

_load_lock = Lock()


def is_compiled() -> bool:
    """Return whether the solver needs not be compiled, or cannot be kept: its folder has files, or is not writable."""
    folder = compile_cache_folder("marionette")
    return folder is None or any(Path(folder).iterdir())


def load_compiled_solver() -> LimbSolver:
    """Load the compiled solver, or compile it the first time; takes seconds.

    Call it in a thread. Servers of one process may call it at the same time.
    """
    with _load_lock:
        solver: LimbSolver = load_kernels("marionette").compile_solver(compile_cache_folder("marionette"))
    return solver
