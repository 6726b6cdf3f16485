"""Those who watch a session, as one of them sees it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from bunraku.stream.cohorts import Cohorts
from bunraku.stream.plans import Plans

if TYPE_CHECKING:
    from bunraku.stream.viewers import Viewer


class Audience(Protocol):
    """All of one session, at one replica."""

    plans: Plans
    cohorts: Cohorts

    def turned(self) -> None:
        """Of one of them the line has room again, or no more."""

    def leave(self, viewer: Viewer) -> None:
        """A viewer goes."""
