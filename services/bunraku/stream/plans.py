"""What the viewers of a session are sent next, worked out once for all who are in step.

Who has been sent all that is within reach waits for the next block to come within it; that instant, and what comes
then, are the same for all who have the same tracks at the same rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.backing.frames import frame
from bunraku.backing.library import StoredMotion
from bunraku.playout.pacing import Due, Paced, Pacer, arrivals
from bunraku.playout.sharing import Step
from bunraku.wire.messages import TimelineState

MOST = 64
"""Plans that are kept."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What comes within reach at an instant: the blocks, their messages framed, and the clock time when the next comes,
    None where nothing moves."""

    dues: list[Due]
    framed: bytes
    following: int | None


class Plans:
    """The plans for one timeline at a time."""

    def __init__(self) -> None:
        self._state: TimelineState | None = None
        self._plans: dict[tuple[Step, tuple[str, ...], int], Plan] = {}

    def at(
        self,
        clock: int,
        state: TimelineState,
        motion: StoredMotion,
        step: Step,
        wanted: tuple[str, ...],
        tracks: Sequence[Paced],
    ) -> Plan:
        """The plan for clock time `clock`, which `Pacer.wait` told; `tracks` are those of the `wanted` types."""
        if state is not self._state or len(self._plans) >= MOST:
            self._state = state
            self._plans.clear()
        plan = self._plans.get((step, wanted, clock))
        if plan is None:
            dues = arrivals(tracks, state, clock, step.motion, step.audio)
            wait = Pacer(tracks).wait(state, clock)
            framed = b"".join(frame(motion.packets[due.track][due.rate][due.index]) for due in dues)
            plan = self._plans[step, wanted, clock] = Plan(dues, framed, None if wait is None else clock + wait)
        return plan
