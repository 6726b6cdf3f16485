"""Limbs solved by compiled code."""

from __future__ import annotations

from threading import Lock

from bunraku.runtime.compile_cache import compile_cache_folder

_load_lock = Lock()


def warm_up_solver() -> None:
    """Load what solves limbs, or the first time compile it; takes seconds, and limbs are solved without before.

    Can be called in a thread, and by several servers of one process at the same time.
    """
    # imported here, as it brings the compiler along
    from bunraku.marionette import jit

    with _load_lock:
        jit.enable(compile_cache_folder("marionette"))
