"""One limb between the dance and a hand: taken, pulled, let go.

Each frame the limb is first shown the dance (`see`), then, while it is not wholly the dance's, pulled (`pull`). It
remembers where it is and how fast it goes, and is moved on by the time between frames, in seconds. Places are hand tips
in the shoulder's frame in arm lengths; of a leg the thigh's angle, first of three.
"""

from __future__ import annotations

from bunraku.marionette import vector
from bunraku.marionette.blend import ArmBlend
from bunraku.marionette.elbow import Elbow, lift_angle
from bunraku.marionette.follower import ZERO_VELOCITY, Follower
from bunraku.marionette.handover import (
    HAND_ACCELERATION,
    THIGH_ACCELERATION,
    DirectionAlignment,
    JointBlend,
    return_acceleration,
)
from bunraku.marionette.limb_rig import ArmRig, JointRotations, LegRig, Limb, Pose
from bunraku.marionette.proportions import MAX_TIP_DISTANCE
from bunraku.marionette.vector import Vector
from bunraku.motion.skeleton import Figure

MAX_REACH = 0.9995
"""Arm lengths: a pulled arm is never quite locked, so that its elbow leaves the line at a bounded speed."""
MIN_REACH = 0.15
"""Arm lengths from the shoulder that a hand is pulled to at least: nearer in, the elbow would have to whirl."""
MAX_HAND_RETURN_ACCELERATION = 79.0
"""Arm lengths per second squared, against the dance, that a hand let go comes back with at most."""
ARRIVAL_TOLERANCE = 1e-6
"""Arm lengths, or radians, within which a limb is the dance's again."""
MIN_WEIGHT = 1e-9
"""A limb on its last way home is still solved for."""


class _ControlledLimb:
    """What hands and legs have in common: how the dance has the limb, and how it moves."""

    def __init__(self) -> None:
        self._motion_position: Vector | None = None
        self._previous_position = ZERO_VELOCITY
        self._velocity = self._previous_velocity = ZERO_VELOCITY
        self._follower: Follower | None = None
        self._return_acceleration: float | None = None

    @property
    def motion_position(self) -> Vector:
        """Where the dance has the limb, as last seen."""
        return self._motion_position or ZERO_VELOCITY

    @property
    def is_controlled(self) -> bool:
        """Whether it is not wholly the dance's."""
        return self._follower is not None

    @property
    def position(self) -> Vector:
        """Where the limb is."""
        return self.motion_position if self._follower is None else self._follower.position

    @property
    def speed(self) -> float:
        """Arm lengths, or radians, per second that it goes at."""
        return 0.0 if self._follower is None else vector.length(self._follower.velocity)

    def _record_position(self, position: Vector, seconds: float) -> None:
        self._previous_position = self._motion_position or position
        self._previous_velocity = self._velocity
        moved = vector.subtract(position, self._previous_position)
        self._velocity = vector.scale(moved, 1.0 / seconds) if seconds > 0.0 else ZERO_VELOCITY
        self._motion_position = position

    def _ensure_follower(self) -> Follower:
        """What moves the limb; it starts from where the dance had it a frame ago, at the speed it had."""
        if self._follower is None:
            self._follower = Follower(self._previous_position, self._previous_velocity)
        return self._follower

    def _choose_return_acceleration(self, max_acceleration: float) -> float:
        """The acceleration on the way back to the dance, settled when the limb is let go."""
        if self._return_acceleration is None:
            follower = self._ensure_follower()
            away = vector.length(vector.subtract(follower.position, self._previous_position))
            speed = vector.length(vector.subtract(follower.velocity, self._velocity))
            self._return_acceleration = return_acceleration(away, speed, max_acceleration)
        return self._return_acceleration


class ControlledHand(_ControlledLimb):
    """One hand of a figure."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        """Raises `ProportionsError` for an arm whose bones are too short to hang."""
        super().__init__()
        self.rig = ArmRig(figure, limb)
        self.reset()

    def reset(self) -> None:
        """The limb is wholly the dance's."""
        self._follower = self._return_acceleration = None
        self._elbow = Elbow(self.rig.arm, self.rig.shoulder)
        self._alignment = DirectionAlignment()
        self._blend = ArmBlend(self.rig)

    def observe_pose(self, pose: Pose, seconds: float) -> None:
        """The dance's pose, `seconds` after the last."""
        self._record_position(self.rig.tip_target(self.rig.pose_joints(pose)), seconds)

    def solve_joints(self, pose: Pose, goal: Vector | None, weight: float, seconds: float) -> JointRotations | None:
        """The arm's joints, `seconds` after the last, in the pose that was seen just now; None once it is back.

        The hand is on its way to `wanted`, or, where that is None, back to the dance; `weight` (0..1) says how far the
        arm has gone over from the dance's way of reaching a place to the marionette's.
        """
        rig, follower, own = self.rig, self._ensure_follower(), self.motion_position
        if goal is not None:
            self._return_acceleration = None
            reach = min(max(vector.length(goal), MIN_REACH), MAX_REACH)
            goal = vector.scale(rig.target_direction(goal), reach)
            hand = follower.step(goal, seconds, HAND_ACCELERATION, rig.arm.min_tip_distance, MAX_TIP_DISTANCE)
        else:
            home = self._choose_return_acceleration(MAX_HAND_RETURN_ACCELERATION)
            # the dance may have its hand nearer to the shoulder than one is pulled
            inner = min(rig.arm.min_tip_distance, vector.length(own))
            hand = follower.step(own, seconds, home, inner, 1.0, self._velocity)
            if weight <= 0.0 and vector.length(vector.subtract(hand, own)) < ARRIVAL_TOLERANCE:
                return None
        dance = rig.pose_joints(pose)
        if not self._elbow.has_begun:
            elbow, chord = rig.joint_positions(dance)[0], rig.target_direction(own)
            self._elbow.begin(chord, rig.plane_normal(dance), lift_angle(elbow, chord))
        tip, normal, bend = self._elbow.step(
            rig.target_direction(hand), vector.length(hand), rig.local_up(pose), seconds
        )
        bent = rig.bend_joints(vector.length(tip), bend)
        # the dance may hold its arms where the marionette's shoulders do not go: that they do not comes with the weight
        target = vector.add(hand, vector.scale(vector.subtract(tip, hand), weight))
        turn = self._alignment.update(own, target, weight)
        return self._blend.blend(dance, bent, target, turn, normal, max(weight, MIN_WEIGHT), seconds)


class ControlledLeg(_ControlledLimb):
    """One leg of a figure."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        super().__init__()
        self.rig = LegRig(figure, limb)
        self.reset()

    def reset(self) -> None:
        """The limb is wholly the dance's."""
        self._follower = self._return_acceleration = None
        self._blend = JointBlend()

    def observe_pose(self, pose: Pose, seconds: float) -> None:
        """The dance's pose, `seconds` after the last."""
        self._record_position((self.rig.thigh_angle(pose, self.motion_position[0]), 0.0, 0.0), seconds)

    def solve_joints(self, pose: Pose, goal: Vector | None, weight: float, seconds: float) -> JointRotations | None:
        """As `PulledHand.pull`, of the leg's joints."""
        follower, own = self._ensure_follower(), self.motion_position
        if goal is not None:
            self._return_acceleration = None
            theta = follower.step(goal, seconds, THIGH_ACCELERATION)[0]
        else:
            home = self._choose_return_acceleration(THIGH_ACCELERATION)
            theta = follower.step(own, seconds, home, frame_velocity=self._velocity)[0]
            if weight <= 0.0 and abs(theta - own[0]) < ARRIVAL_TOLERANCE:
                return None
        return self._blend.blend(self.rig.pose_joints(pose), self.rig.solve(theta, pose), max(weight, MIN_WEIGHT))
