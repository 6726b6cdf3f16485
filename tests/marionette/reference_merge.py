"""Reference implementation of the merge, for comparison with the real one.

It is slow and simple: each frame replays all inputs received so far, in order. The only state between frames is that of
the limbs (`controlled_limb`), which have separate tests.
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
    """Input of a puppeteer; `sampled_us` is a time of the sender's clock."""

    received_us: int
    sampled_us: int
    sequence: int
    kind: int
    values: Vector


@dataclass
class LimbHold:
    """Control of a limb by a puppeteer; `heard_us` are the times of its messages."""

    puppeteer: str
    epoch: int
    granted_us: int
    heard_us: list[int] = field(default_factory=list)
    inputs: list[ReceivedInput] = field(default_factory=list)

    def active_us(self, clock: int) -> int:
        """Return the time since the grant, without silences."""
        times = [self.granted_us, *self.heard_us]
        elapsed_us = sum(min(b - a, HOLD_TIMEOUT_US) for a, b in pairwise(times))
        return elapsed_us + min(max(clock - times[-1], 0), HOLD_TIMEOUT_US)

    def active_us_at(self, received: ReceivedInput) -> int:
        """Return `active_us` at the reception of an input."""
        return LimbHold(
            self.puppeteer, self.epoch, self.granted_us, self.heard_us[: self.heard_us.index(received.received_us) + 1]
        ).active_us(received.received_us)

    def ordered_inputs(self) -> list[tuple[ReceivedInput, int]]:
        """Return the inputs by sequence, each with its sample time on the scale of `active_us`."""
        ordered: list[tuple[ReceivedInput, int]] = []
        for index, received in enumerate(self.inputs):
            lag_us = received.received_us - received.sampled_us
            # the input with the least delay so far counts as not delayed: clock offsets cancel
            delay_us = lag_us - min(other.received_us - other.sampled_us for other in self.inputs[: index + 1])
            ordered.append((received, max(self.active_us_at(received) - min(delay_us, HOLD_TIMEOUT_US), 0)))
        return sorted(ordered, key=lambda pair: pair[0].sequence)

    def target_at(self, limb: Limb, start: Vector, clock: int) -> Vector:
        """Return the target of the limb: all inputs replayed from the first."""
        time_us, value = 0, start
        destination: Vector | None = None
        duration_us, speed = 0, (0.0, 0.0, 0.0)

        def value_at(until_us: int) -> Vector:
            if destination is not None:
                elapsed_us = until_us - time_us
                if elapsed_us >= duration_us:
                    return destination
                return vector.add(value, vector.scale(vector.subtract(destination, value), elapsed_us / duration_us))
            if speed == (0.0, 0.0, 0.0):
                return value
            return clamp_to_reach(limb.is_hand, vector.add(value, vector.scale(speed, (until_us - time_us) * 1e-6)))

        for received, sampled_us in self.ordered_inputs():
            input_us = max(time_us, sampled_us)
            value, previous_us, time_us = value_at(input_us), time_us, input_us
            if received.kind == 1:
                destination, duration_us = (
                    clamp_to_reach(limb.is_hand, received.values),
                    min(input_us - previous_us, MAX_TARGET_DURATION_US),
                )
            else:
                max_speed = MAX_HAND_SPEED if limb.is_hand else MAX_LEG_SPEED
                x, y, z = (min(max(part, -1.0), 1.0) * max_speed for part in received.values)
                destination, speed = None, (x, y, z) if limb.is_hand else (x, 0.0, 0.0)
        return value_at(max(self.active_us(clock), time_us))


class ReferenceMarionette:
    """Performer whose limbs are claimed and controlled."""

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
        """Return the granted epoch, or None if another puppeteer holds the limb."""
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
        """Release a limb."""
        hold = self.holds[limb]
        if hold is not None and (hold.puppeteer, hold.epoch) == (puppeteer, epoch):
            self.holds[limb] = None

    def keep_alive(self, limb: Limb, puppeteer: str, clock: int) -> None:
        """Record a heartbeat of the holder."""
        hold = self.holds[limb]
        if hold is not None and hold.puppeteer == puppeteer:
            hold.heard_us.append(clock)

    def apply_input(self, limb: Limb, puppeteer: str, epoch: int, received: ReceivedInput) -> None:
        """Apply an input of the current epoch that is not a duplicate and not too old."""
        hold = self.holds[limb]
        if hold is None or (hold.puppeteer, hold.epoch) != (puppeteer, epoch):
            return
        known = {i.sequence for i in hold.inputs}
        newest_first = sorted(known, reverse=True)
        if received.sequence in known or (
            len(known) > MAX_REORDERED_INPUTS and received.sequence < newest_first[MAX_REORDERED_INPUTS]
        ):
            return
        hold.inputs.append(received)
        hold.heard_us.append(received.received_us)

    def expire(self, clock: int) -> None:
        """Free the limbs of silent holders."""
        for limb, hold in self.holds.items():
            if hold is not None and clock - max([hold.granted_us, *hold.heard_us]) >= INPUT_TIMEOUT_US:
                self.holds[limb] = None

    def solve_frame(self, pose: Pose, clock: int, seconds: float) -> dict[Limb, JointRotations]:
        """Return the joints of the limbs that are controlled or return to the motion."""
        overlay: dict[Limb, JointRotations] = {}
        for limb, controlled in self.limbs.items():
            hold = self.holds[limb]
            self.handovers[limb].advance(hold is not None, seconds)
            controlled.observe_pose(pose, seconds)
            if not self.is_controlled[limb]:
                continue
            target = None
            if hold is not None:
                if self.starts[limb] is None:
                    self.starts[limb] = controlled.position
                start = self.starts[limb]
                assert start is not None
                target = hold.target_at(limb, start, clock)
            joints = controlled.solve_joints(pose, target, self.handovers[limb].weight, seconds)
            if joints is None:
                self.is_controlled[limb] = False
                controlled.reset()
            else:
                overlay[limb] = joints
        return overlay
