"""Arms of two bonded hands in one frame: what their bond needs to know of them, and where both can be."""

from __future__ import annotations

from bunraku.marionette.bond.bond import HandMotion
from bunraku.marionette.bond.carrier import Shoulder
from bunraku.marionette.controlled_limb import ControlledHand
from bunraku.marionette.limb_rig import Pose
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import Vector

SETTLE_ROUNDS = 8
"""Rounds in which the arms agree on a position that the shoulder's limit allows both."""
SETTLED_DISTANCE_M = 1e-9


class BondedArm:
    """Arm of one bonded hand in a pose."""

    def __init__(self, hand: ControlledHand, pose: Pose, root: Vector, seconds: float) -> None:
        """`root` is the position of the pose's root on the stage, `seconds` the time since the frame before."""
        self._hand = hand
        self._pose = pose
        self.seconds = seconds
        position, rotation = hand.rig.shoulder_frame(root, pose)
        self.shoulder = Shoulder(position, rotation, hand.rig.arm_length_m, hand.rig.arm.min_tip_distance)

    @property
    def motion(self) -> HandMotion:
        """Where the hand is in this frame if nothing moves it."""
        return self._hand.next_motion(self.seconds)

    def reachable_position(self, position: Vector) -> Vector:
        """Return the position next to `position` that the arm reaches, within the shoulder's limit."""
        place = self.shoulder.to_place(position)
        return self.shoulder.to_world(self._hand.reachable_place(self._pose, place, self.seconds))


def settle(first: BondedArm, second: BondedArm, position: Vector) -> Vector:
    """Return the position next to `position` that both arms reach: each in turn moves it into its own reach."""
    for _ in range(SETTLE_ROUNDS):
        reached = second.reachable_position(first.reachable_position(position))
        if vector.length(vector.subtract(reached, position)) < SETTLED_DISTANCE_M:
            break
        position = reached
    return position
