"""Viewers of a session who are in step: what comes for one of them comes for all, and is written to all at once.

What costs is not the writing but going from viewer to viewer, whose things lie all over the memory. So who has been
sent all that is within reach, over a quick line, needs no turns of its own for the blocks that follow: it joins a
cohort, which has one turn for all. Blocks are due to all viewers of a session at once; each cohort is sent them up to a
second later, so that the server's work is even.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from bunraku.backing.library import StoredMotion
from bunraku.backing.outlet import Outlet
from bunraku.backing.together import Together
from bunraku.playout.pacing import Paced
from bunraku.playout.sharing import Step
from bunraku.playout.wheel import SPOKE
from bunraku.stream.attendance import Attendance
from bunraku.stream.plans import Plans
from bunraku.stream.turns import Turns
from bunraku.wire.messages import TimelineState


class Member(Protocol):
    """A viewer, as its cohort sees it; its outlet is `clear`."""

    outlet: Outlet


@dataclass(frozen=True, slots=True)
class Course:
    """What those who are in step have in common: the timeline, the motion, how motion and sound share the line, and the
    types of tracks that are wanted."""

    state: TimelineState
    motion: StoredMotion
    step: Step
    wanted: tuple[str, ...]

    @property
    def key(self) -> tuple[int, Step, tuple[str, ...]]:
        """Of one session, what tells one course from another."""
        return self.state.epoch, self.step, self.wanted


class Cohort:
    """Those who are in step and are sent what comes `phase` microseconds after it is due."""

    __slots__ = (
        "_cohorts",
        "_members",
        "_plans",
        "_sent",
        "_together",
        "_tracks",
        "_turns",
        "course",
        "following",
        "phase",
    )

    def __init__(
        self, cohorts: Cohorts, turns: Turns, course: Course, tracks: Sequence[Paced], following: int, phase: int
    ) -> None:
        self._cohorts = cohorts
        self._turns = turns
        self._tracks = tracks
        self.course = course
        self.following: int | None = following
        """Clock time of the next instant at which something comes within reach, None where nothing will."""
        self.phase = phase
        # each with the first instant that is sent to it here
        self._members: dict[Member, int] = {}
        self._together: Together | None = None
        # of each block the rate, and the instant at which it was sent last
        self._sent: dict[tuple[int, int], tuple[int, int]] = {}
        turns.put(self, following + phase)

    def join(self, member: Member, following: int) -> bool:
        """One comes who has been sent all before the instant `following`; whether it can."""
        if self.following is None or following < self.following:
            return False
        self._members[member] = following
        self._together = None
        return True

    def leave(self, member: Member) -> Iterator[tuple[int, int, int]]:
        """One goes: track, index and rate of each block that it was sent here."""
        begun = self._members.pop(member)
        self._together = None
        if not self._members:
            self._turns.remove(self)
            self._cohorts.end(self)
        return ((*block, rate) for block, (rate, at) in self._sent.items() if at >= begun)

    def advance(self) -> None:
        """Have a turn: send what came within reach."""
        course, at = self.course, self.following
        if at is None:
            return
        plan = self._cohorts.plans.at(at, course.state, course.motion, course.step, course.wanted, self._tracks)
        self._sent.update({(due.track, due.index): (due.rate, at) for due in plan.dues})
        self.following = plan.following
        if self.following is not None:
            self._turns.put(self, self.following + self.phase)
        if self._together is None:
            now = [member.outlet for member, begun in self._members.items() if begun <= at]
            together = Together(now)
            if len(now) == len(self._members):
                self._together = together
        else:
            together = self._together
        if plan.framed:
            attendance = self._cohorts.attendance
            attendance.bytes += together.write(plan.framed)
            attendance.blocks += len(plan.dues) * len(together)


class Cohorts:
    """The cohorts of one session."""

    def __init__(self, plans: Plans, attendance: Attendance | None = None) -> None:
        """`attendance` counts what is sent."""
        self.plans = plans
        self.attendance = attendance or Attendance()
        self._cohorts: dict[tuple[object, ...], Cohort] = {}

    def join(
        self, member: Member, turns: Turns, course: Course, tracks: Sequence[Paced], following: int, phase: int
    ) -> Cohort | None:
        """The cohort that a viewer who was sent all before the instant `following` is in from now on, None where it
        cannot be in one yet; `tracks` are those of the wanted types, `phase` is in microseconds."""
        slot = phase // SPOKE
        key = (*course.key, slot)
        cohort = self._cohorts.get(key)
        if cohort is None:
            cohort = self._cohorts[key] = Cohort(self, turns, course, tracks, following, slot * SPOKE)
        elif cohort.course.state is not course.state:
            return None
        return cohort if cohort.join(member, following) else None

    def end(self, cohort: Cohort) -> None:
        """The last one left it."""
        self._cohorts = {key: one for key, one in self._cohorts.items() if one is not cohort}

    def __iter__(self) -> Iterator[Cohort]:
        return iter(tuple(self._cohorts.values()))
