"""The merge as it would be told to a child: for each frame, all that has come so far, in order, from the beginning.

No state is carried on but the limbs themselves (`pulled`), which have tests of their own. It is slow and plain; what it
is there for is to be compared with.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from bunraku.marionette import vector
from bunraku.marionette.handover import Handover
from bunraku.marionette.limbs import Joints, Limb, Pose
from bunraku.marionette.ownership import LOST_AFTER
from bunraku.marionette.pulled import PulledHand, PulledLeg
from bunraku.marionette.steering import HAND_SPEED, HOLD_AFTER, KEPT, LEG_SPEED, LONGEST_WAY, within_reach
from bunraku.marionette.vector import Vector
from bunraku.motion.skeleton import Figure


@dataclass
class Came:
    """One input as it came: at `came`, made at `sampled` by the sender's own clock."""

    came: int
    sampled: int
    sequence: int
    kind: int
    values: Vector


@dataclass
class Hold:
    """One limb in one hand since `since`: words are the times at which its holder said anything."""

    who: str
    epoch: int
    since: int
    words: list[int] = field(default_factory=list)
    inputs: list[Came] = field(default_factory=list)

    def alive(self, clock: int) -> int:
        """Microseconds since the grant, without the silences."""
        times = [self.since, *self.words]
        passed = sum(min(b - a, HOLD_AFTER) for a, b in pairwise(times))
        return passed + min(max(clock - times[-1], 0), HOLD_AFTER)

    def alive_at(self, one: Came) -> int:
        """`alive` when an input came."""
        return Hold(self.who, self.epoch, self.since, self.words[: self.words.index(one.came) + 1]).alive(one.came)

    def counted(self) -> list[tuple[Came, int]]:
        """The inputs that count, in order, each with when it was made in the time of `alive`."""
        taken: list[tuple[Came, int]] = []
        for nth, one in enumerate(self.inputs):
            lag = one.came - one.sampled
            # the quickest so far is taken to have needed no time, whatever the sender's clock says
            late = lag - min(other.came - other.sampled for other in self.inputs[: nth + 1])
            taken.append((one, max(self.alive_at(one) - min(late, HOLD_AFTER), 0)))
        return sorted(taken, key=lambda pair: pair[0].sequence)

    def wanted(self, limb: Limb, start: Vector, clock: int) -> Vector:
        """Where the limb should be: all inputs played from the first."""
        at, value = 0, start
        goal: Vector | None = None
        way, speed = 0, (0.0, 0.0, 0.0)

        def along(until: int) -> Vector:
            if goal is not None:
                passed = until - at
                if passed >= way:
                    return goal
                return vector.add(value, vector.scale(vector.subtract(goal, value), passed / way))
            if speed == (0.0, 0.0, 0.0):
                return value
            return within_reach(limb.is_hand, vector.add(value, vector.scale(speed, (until - at) * 1e-6)))

        for one, made in self.counted():
            then = max(at, made)
            value, before, at = along(then), at, then
            if one.kind == 1:
                goal, way = within_reach(limb.is_hand, one.values), min(then - before, LONGEST_WAY)
            else:
                full = HAND_SPEED if limb.is_hand else LEG_SPEED
                x, y, z = (min(max(part, -1.0), 1.0) * full for part in one.values)
                goal, speed = None, (x, y, z) if limb.is_hand else (x, 0.0, 0.0)
        return along(max(self.alive(clock), at))


class ModelPuppet:
    """One puppet: who holds what, and the limbs' joints frame by frame."""

    def __init__(self, figure: Figure) -> None:
        self.limbs: dict[Limb, PulledHand | PulledLeg] = {
            limb: PulledHand(figure, limb) if limb.is_hand else PulledLeg(figure, limb) for limb in Limb
        }
        self.handovers = {limb: Handover() for limb in Limb}
        self.holds: dict[Limb, Hold | None] = dict.fromkeys(Limb)
        self.starts: dict[Limb, Vector | None] = dict.fromkeys(Limb)
        self.busy = dict.fromkeys(Limb, False)
        self.epochs = dict.fromkeys(Limb, 0)

    def claim(self, limb: Limb, who: str, clock: int) -> int | None:
        """The epoch granted, None where another holds the limb."""
        hold = self.holds[limb]
        if hold is not None and hold.who != who:
            return None
        self.epochs[limb] += 1
        self.holds[limb], self.starts[limb], self.busy[limb] = Hold(who, self.epochs[limb], clock), None, True
        return self.epochs[limb]

    def release(self, limb: Limb, who: str, epoch: int) -> None:
        """Lets a limb go."""
        hold = self.holds[limb]
        if hold is not None and (hold.who, hold.epoch) == (who, epoch):
            self.holds[limb] = None

    def alive(self, limb: Limb, who: str, clock: int) -> None:
        """Its holder said that it still holds it."""
        hold = self.holds[limb]
        if hold is not None and hold.who == who:
            hold.words.append(clock)

    def input(self, limb: Limb, who: str, epoch: int, one: Came) -> None:
        """An input came."""
        hold = self.holds[limb]
        if hold is None or (hold.who, hold.epoch) != (who, epoch):
            return
        known = {i.sequence for i in hold.inputs}
        newer = sorted(known, reverse=True)
        if one.sequence in known or (len(known) > KEPT and one.sequence < newer[KEPT]):
            return
        hold.inputs.append(one)
        hold.words.append(one.came)

    def expire(self, clock: int) -> None:
        """Limbs of silent holders are free."""
        for limb, hold in self.holds.items():
            if hold is not None and clock - max([hold.since, *hold.words]) >= LOST_AFTER:
                self.holds[limb] = None

    def frame(self, pose: Pose, clock: int, seconds: float) -> dict[Limb, Joints]:
        """The joints of the limbs that are not wholly the dance's."""
        shown: dict[Limb, Joints] = {}
        for limb, pulled in self.limbs.items():
            hold = self.holds[limb]
            self.handovers[limb].advance(hold is not None, seconds)
            pulled.see(pose, seconds)
            if not self.busy[limb]:
                continue
            wanted = None
            if hold is not None:
                if self.starts[limb] is None:
                    self.starts[limb] = pulled.place
                start = self.starts[limb]
                assert start is not None
                wanted = hold.wanted(limb, start, clock)
            joints = pulled.pull(pose, wanted, self.handovers[limb].weight, seconds)
            if joints is None:
                self.busy[limb] = False
                pulled.rest()
            else:
                shown[limb] = joints
        return shown
