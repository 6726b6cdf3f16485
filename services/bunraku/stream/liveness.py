"""Whether a viewer is there still: one of whom nothing is heard is asked, and given up when nothing comes."""

from __future__ import annotations

from bunraku.backing.outlet import Outlet

SILENT = 12_000_000
"""A viewer of whom nothing was heard for this long, microseconds, is asked for a sign of life."""
GONE = 18_000_000
"""One of whom nothing was heard for this long is there no more."""


class Liveness:
    """Of one viewer. Times are clock times in microseconds."""

    __slots__ = ("_asked",)

    def __init__(self) -> None:
        # when it was heard last before it was asked
        self._asked = 0

    def look(self, outlet: Outlet, now: int) -> bool:
        """Whether it is there, so far as is known; asks where that is long ago."""
        silence = now - outlet.heard
        if SILENT < silence <= GONE and outlet.heard != self._asked:
            self._asked = outlet.heard
            outlet.ping()
        return silence <= GONE

    def due(self, outlet: Outlet) -> int:
        """When to look next."""
        return outlet.heard + (GONE if outlet.heard == self._asked else SILENT) + 1
