"""The merge as it would be told to a child: for each frame, all that has come so far, in order, from the beginning.

No state is carried on but the limbs themselves (`pulled`), which have tests of their own. It is slow and plain; what it
is there for is to be compared with.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from bunraku.marionette.constants import MAX_HAND_SPEED, MAX_LEG_SPEED, MAX_TARGET_DURATION_US
from bunraku.marionette.controlled_limb import ControlledHand, ControlledLeg
from bunraku.marionette.handover import Handover
from bunraku.marionette.limb_rig import Limb, Pose
from bunraku.marionette.limb_target import HOLD_TIMEOUT_US, MAX_REORDERED_INPUTS, clamp_to_reach
from bunraku.marionette.ownership import INPUT_TIMEOUT_US
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import JointRotations, Vector
from bunraku.motion.skeleton import Figure


@dataclass
class ReceivedInput:
    """One input as it came: at `came`, made at `sampled` by the sender's own clock."""

    received_us: int
    sampled_us: int
    sequence: int
    kind: int
    values: Vector


@dataclass
class LimbHold:
    """One limb in one hand since `since`: words are the times at which its holder said anything."""

    puppeteer: str
    epoch: int
    granted_us: int
    heard_us: list[int] = field(default_factory=list)
    inputs: list[ReceivedInput] = field(default_factory=list)

    def active_us(self, clock: int) -> int:
        """Microseconds since the grant, without the silences."""
        times = [self.granted_us, *self.heard_us]
        passed = sum(min(b - a, HOLD_TIMEOUT_US) for a, b in pairwise(times))
        return passed + min(max(clock - times[-1], 0), HOLD_TIMEOUT_US)

    def active_us_at(self, one: ReceivedInput) -> int:
        """`alive` when an input came."""
        return LimbHold(
            self.puppeteer, self.epoch, self.granted_us, self.heard_us[: self.heard_us.index(one.received_us) + 1]
        ).active_us(one.received_us)

    def ordered_inputs(self) -> list[tuple[ReceivedInput, int]]:
        """The inputs that count, in order, each with when it was made in the time of `alive`."""
        taken: list[tuple[ReceivedInput, int]] = []
        for nth, one in enumerate(self.inputs):
            lag = one.received_us - one.sampled_us
            # the quickest so far is taken to have needed no time, whatever the sender's clock says
            late = lag - min(other.received_us - other.sampled_us for other in self.inputs[: nth + 1])
            taken.append((one, max(self.active_us_at(one) - min(late, HOLD_TIMEOUT_US), 0)))
        return sorted(taken, key=lambda pair: pair[0].sequence)

    def target_at(self, limb: Limb, start: Vector, clock: int) -> Vector:
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
            return clamp_to_reach(limb.is_hand, vector.add(value, vector.scale(speed, (until - at) * 1e-6)))

        for one, made in self.ordered_inputs():
            then = max(at, made)
            value, before, at = along(then), at, then
            if one.kind == 1:
                goal, way = clamp_to_reach(limb.is_hand, one.values), min(then - before, MAX_TARGET_DURATION_US)
            else:
                full = MAX_HAND_SPEED if limb.is_hand else MAX_LEG_SPEED
                x, y, z = (min(max(part, -1.0), 1.0) * full for part in one.values)
                goal, speed = None, (x, y, z) if limb.is_hand else (x, 0.0, 0.0)
        return along(max(self.active_us(clock), at))


class ReferenceMarionette:
    """One puppet: who holds what, and the limbs' joints frame by frame."""

    def __init__(self, figure: Figure) -> None:
        self.limbs: dict[Limb, ControlledHand | ControlledLeg] = {
            limb: ControlledHand(figure, limb) if limb.is_hand else ControlledLeg(figure, limb) for limb in Limb
        }
        self.handovers = {limb: Handover() for limb in Limb}
        self.holds: dict[Limb, LimbHold | None] = dict.fromkeys(Limb)
        self.starts: dict[Limb, Vector | None] = dict.fromkeys(Limb)
        self.is_controlled = dict.fromkeys(Limb, False)
        self.epochs = dict.fromkeys(Limb, 0)

    def claim(self, limb: Limb, puppeteer: str, clock: int) -> int | None:
        """The epoch granted, None where another holds the limb."""
        hold = self.holds[limb]
        if hold is not None and hold.puppeteer != puppeteer:
            return None
        self.epochs[limb] += 1
        self.holds[limb], self.starts[limb], self.is_controlled[limb] = (
            LimbHold(puppeteer, self.epochs[limb], clock),
            None,
            True,
        )
        return self.epochs[limb]

    def release(self, limb: Limb, puppeteer: str, epoch: int) -> None:
        """Lets a limb go."""
        hold = self.holds[limb]
        if hold is not None and (hold.puppeteer, hold.epoch) == (puppeteer, epoch):
            self.holds[limb] = None

    def keep_alive(self, limb: Limb, puppeteer: str, clock: int) -> None:
        """Its holder said that it still holds it."""
        hold = self.holds[limb]
        if hold is not None and hold.puppeteer == puppeteer:
            hold.heard_us.append(clock)

    def apply_input(self, limb: Limb, puppeteer: str, epoch: int, received: ReceivedInput) -> None:
        """An input came."""
        hold = self.holds[limb]
        if hold is None or (hold.puppeteer, hold.epoch) != (puppeteer, epoch):
            return
        known = {i.sequence for i in hold.inputs}
        newer = sorted(known, reverse=True)
        if received.sequence in known or (
            len(known) > MAX_REORDERED_INPUTS and received.sequence < newer[MAX_REORDERED_INPUTS]
        ):
            return
        hold.inputs.append(received)
        hold.heard_us.append(received.received_us)

    def expire(self, clock: int) -> None:
        """Limbs of silent holders are free."""
        for limb, hold in self.holds.items():
            if hold is not None and clock - max([hold.granted_us, *hold.heard_us]) >= INPUT_TIMEOUT_US:
                self.holds[limb] = None

    def solve_frame(self, pose: Pose, clock: int, seconds: float) -> dict[Limb, JointRotations]:
        """The joints of the limbs that are not wholly the dance's."""
        shown: dict[Limb, JointRotations] = {}
        for limb, pulled in self.limbs.items():
            hold = self.holds[limb]
            self.handovers[limb].advance(hold is not None, seconds)
            pulled.observe_pose(pose, seconds)
            if not self.is_controlled[limb]:
                continue
            wanted = None
            if hold is not None:
                if self.starts[limb] is None:
                    self.starts[limb] = pulled.position
                start = self.starts[limb]
                assert start is not None
                wanted = hold.target_at(limb, start, clock)
            joints = pulled.solve_joints(pose, wanted, self.handovers[limb].weight, seconds)
            if joints is None:
                self.is_controlled[limb] = False
                pulled.reset()
            else:
                shown[limb] = joints
        return shown
