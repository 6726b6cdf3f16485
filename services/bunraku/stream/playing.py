"""One motion as it is sent to one viewer: which block is next and at which rate, and what the viewer is told of it."""

from __future__ import annotations

from bunraku.backing.frames import frame
from bunraku.backing.library import StoredMotion
from bunraku.playout import sharing
from bunraku.playout.held import Held
from bunraku.playout.pacing import Pacer
from bunraku.playout.rate import RateChoice
from bunraku.playout.sharing import Step
from bunraku.playout.window import HEADS
from bunraku.stream.flow import Flow
from bunraku.stream.tracks import danced, described, paced, steps, told_of
from bunraku.wire.messages import Choice, Report, TimelineState

BESIDE = 1_000_000
"""So long after an overlay the hands share a narrow line with blocks, microseconds."""
STILL = 1.5
"""A block for which a narrow line has time takes it so many seconds at most: who plays on meanwhile waits for it."""


class Playing:
    """What one viewer has been sent of `motion`, and at which rate it is sent the rest; times are clock times in
    microseconds."""

    __slots__ = (
        "_alone",
        "_known",
        "_narrow",
        "_pinned",
        "_silent",
        "_tells",
        "_told",
        "_wanted",
        "motion",
        "pacer",
        "rate",
        "steps",
        "tracks",
        "unsaid",
    )

    def __init__(self, motion: StoredMotion, wanted: tuple[str, ...], pinned: int | None) -> None:
        """`wanted` are the types of tracks whose blocks are sent, `pinned` the motion's rate to keep to, if any."""
        self.motion = motion
        self.tracks = paced(motion, wanted)
        # tracks that the viewer is to be told of, and was
        self._wanted = told_of(motion, wanted)
        self._known = self._wanted
        self.pacer = Pacer(self.tracks)
        self.steps = sharing.pinned(steps(motion, wanted), pinned)
        first, safe = sharing.first_step(self.steps), sharing.safe_step(self.steps)
        self.rate = RateChoice(len(self.steps), None, first, safe, [step.kbps for step in self.steps])
        # where no sound is sent all is the motion's
        costs = danced(motion)
        self._silent = [Step(nth, -1, kbps) for nth, kbps in enumerate(costs)]
        self._alone = RateChoice(len(self._silent), costs=costs)
        self._pinned = pinned is not None
        self._tells = "motion" in wanted
        self._narrow = False
        self._told: Choice | None = None
        self.unsaid = True
        """Whether `news` may have something to say."""

    @property
    def step(self) -> sharing.Step:
        """How motion and sound share the line now."""
        chosen = self._choosing
        return self._silent[chosen.rate] if chosen is self._alone else self.steps[chosen.rate]

    @property
    def choice(self) -> tuple[int, str]:
        """The motion's rate now, and why."""
        return self.step.motion, "pinned" if self._pinned else self._choosing.reason

    @property
    def _choosing(self) -> RateChoice:
        silent = len(self.steps) > 1 and self.steps[0].audio < 0 <= self.steps[-1].audio
        return self._alone if silent and not self._pinned and self.rate.rate == 0 else self.rate

    def has(self, held: Held | None) -> bool:
        """What the viewer holds already is not sent again; whether it is of this motion."""
        if held is None or held.motion != self.motion.id:
            return False
        self._told_of(min(len(self.motion.tracks) if held.tracks is None else held.tracks, self._wanted))
        # dances are the first tracks; of one that is yet to be told of nothing can be held
        dances = self.motion.dances[: self._known]
        for number, (dance, (first, rates)) in enumerate(zip(dances, held.performers, strict=False)):
            for index, rate in enumerate(rates, first):
                if rate >= 0:
                    self.pacer.has(number, index % dance.track.blocks, rate)
        return True

    def described(self, far: bool) -> bytes:
        """The Description that goes before all else: of the motion alone where the line is `far` and there is more."""
        self._told_of(1 if far and self._tells else self._wanted)
        return described(self.motion, 0, self._known)

    def _told_of(self, known: int) -> None:
        self._known = known
        self.pacer.tracks = [track for track in self.tracks if track.number < known]

    def report(self, report: Report, clock: int) -> bool:
        """How the viewer fares; whether rate or reason have changed."""
        before = self.step, self._choosing.reason
        for choice in (self.rate, self._alone):
            choice.report(report, clock)
        changed = (self.step, self._choosing.reason) != before
        self.unsaid = self.unsaid or changed
        return changed

    def next_packet(self, state: TimelineState, clock: int, flow: Flow, beside_at: int) -> bytes | None:
        """The Data to send next, None when enough is on its way; an overlay waited for room at `beside_at`."""
        narrow = flow.narrow
        beside = narrow and clock - beside_at < BESIDE
        for choice in (self.rate, self._alone):
            choice.line(flow.carries, clock, beside)
        self._narrow = narrow
        step = self.steps[0] if flow.unknown else self.step
        if self._known < self._wanted:
            due = self.pacer.next(state, clock, step.motion, audio=step.audio, net=True, spare=False)
            if due is None:
                # the motion goes on for a while
                known = self._known
                self._told_of(self._wanted)
                return described(self.motion, known, self._known)
            return self.motion.packets[due.track][due.rate][due.index]
        spare = not beside or flow.blocks_turn()
        net = narrow or flow.far
        better = not net or flow.net_came
        due = self.pacer.next(
            state,
            clock,
            step.motion,
            audio=step.audio,
            net=net,
            spare=spare,
            better=better,
            idle=step.motion if beside else self._idle_rate(flow),
        )
        if not better and spare and (due is None or due.far):
            flow.net_went()
        return None if due is None else self.motion.packets[due.track][due.rate][due.index]

    def _idle_rate(self, flow: Flow) -> int:
        """The rate of what a line has time for: the highest of which a block takes it no longer than `STILL`, unless
        what it carries is not why there is a lower one."""
        step, carries = self.step, flow.carries
        if flow.unknown or self._choosing.reason in ("hidden", "machine"):
            return step.motion
        highest = self.steps[-1].motion
        if carries is None:
            return highest
        # what a second of one performer costs on the line
        costs = (each.kbps * 125 / len(self.motion.dances) + HEADS for each in self._silent[: highest + 1])
        return max([step.motion, *(rate for rate, cost in enumerate(costs) if cost <= STILL * carries)])

    def news(self) -> bytes | None:
        """The framed choice of a rate, where the viewer has not been told yet."""
        self.unsaid = False
        if not self._tells:
            return None
        chosen = self._choosing
        reason = "pinned" if self._pinned else chosen.reason
        choice = Choice(self.step.motion, reason, chosen.carried if self._narrow else None)
        told, self._told = self._told, choice
        if told is not None and (told.rate, told.reason) == (choice.rate, choice.reason):
            return None
        return frame(choice.pack())
