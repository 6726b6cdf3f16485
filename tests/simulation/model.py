"""What the clients of a simulation were promised, and what the services did to them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from tests.simulation.puppeteer import SimulatedPuppeteer
from tests.simulation.viewer import SimulatedViewer


class SessionState(Enum):
    """Session as its clients know it."""

    OPEN = "open"
    UNKNOWN = "unknown"
    """A request to end it was not answered."""
    ENDED = "ended"
    """A request to end it was answered with success."""


@dataclass
class MotionModel:
    """Motion as its clients know it."""

    is_promised: bool = False
    """True if an upload was acknowledged, and no removal has run since its start."""
    removals: int = 0
    """Number of removals requested so far."""
    running_removals: int = 0
    """Number of removals that are not answered: each may take effect at any time."""


@dataclass
class Model:
    """Sessions, motions and clients of a simulation."""

    sessions: dict[str, SessionState] = field(default_factory=dict)
    motions: dict[str, MotionModel] = field(default_factory=dict)
    viewers: list[SimulatedViewer] = field(default_factory=list)
    puppeteers: list[SimulatedPuppeteer] = field(default_factory=list)

    def open_sessions(self) -> list[str]:
        """Return the sessions that must exist."""
        return [session for session, state in self.sessions.items() if state is SessionState.OPEN]
