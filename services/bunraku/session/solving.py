"""Limbs solved by compiled code."""

from __future__ import annotations

from threading import Lock

from bunraku.backing.cache import cache_of

_one_loads = Lock()


def warm() -> None:
    """Load what solves limbs, or the first time compile it; takes seconds, and limbs are solved without before.

    Can be called in a thread, and by several servers of one process at the same time.
    """
    # imported here, as it brings the compiler along
    from bunraku.marionette import compiled

    with _one_loads:
        compiled.load(cache_of("marionette"))
