"""One viewer's being in step with others: with whom, and until when."""

from __future__ import annotations

from bunraku.playout.pacing import MARGIN
from bunraku.playout.sharing import Step
from bunraku.stream.cohorts import Cohort, Cohorts, Course, Member
from bunraku.stream.playing import Playing
from bunraku.stream.turns import Turns
from bunraku.wire.messages import TimelineState

SPREAD = 1_000_000
"""Blocks are due to all viewers of a session at once, and sent to each up to this much later, microseconds: little of
what is sent ahead, and the server's work is even."""
TOGETHER = 4_000_000
"""Who will be in step for less, microseconds, goes on alone."""


class InStep:
    """Nobody at first. Times are clock times in microseconds."""

    __slots__ = ("_member", "cohort", "until")

    def __init__(self, member: Member) -> None:
        self._member = member
        self.cohort: Cohort | None = None
        """Those it is in step with: what comes for all of them is written to it too."""
        self.until = 0
        """Until then at the latest."""

    def join(
        self,
        cohorts: Cohorts,
        turns: Turns,
        state: TimelineState,
        playing: Playing,
        wanted: tuple[str, ...],
        following: int,
        phase: int,
    ) -> bool:
        """Go on with others, where it will be in step for a while: it was sent all that comes within reach before the
        instant `following`. `wanted` are the types of tracks, `phase` is how much later than they are due blocks go to
        it. Whether it does."""
        # what comes from that instant on, which may have passed
        begin = following - MARGIN
        fresh = playing.pacer.fresh(state, begin)
        if fresh < TOGETHER:
            return False
        course = Course(state, playing.motion, playing.step, wanted)
        self.cohort = cohorts.join(self._member, turns, course, playing.tracks, following, phase)
        self.until = begin + fresh - SPREAD
        return self.cohort is not None

    def lasts(self, now: int, step: Step) -> bool:
        """Whether it is in step still, at the rates that it is to have now."""
        return self.cohort is not None and now < self.until and self.cohort.course.step == step

    def leave(self, playing: Playing | None) -> None:
        """Go on alone; what it was sent meanwhile counts as sent in `playing`."""
        cohort, self.cohort = self.cohort, None
        if cohort is None:
            return
        sent = cohort.leave(self._member)
        if playing is not None:
            for track, index, rate in sent:
                playing.pacer.has(track, index, rate)
