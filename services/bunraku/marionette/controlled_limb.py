"""One limb between the stored motion and a puppeteer, from claim to return.

Each frame the limb first observes the motion's pose (`observe_pose`), then, while it is controlled, its joints are
solved (`solve_joints`). Its state is position and velocity, advanced by the time between frames in seconds. A position
is a hand tip in the shoulder's frame in arm lengths, or a thigh angle in radians, the first of three numbers.
"""

from __future__ import annotations

from bunraku.marionette.blend import ArmBlend
from bunraku.marionette.bond.bond import HandMotion
from bunraku.marionette.constants import (
    ARRIVAL_TOLERANCE,
    HAND_ACCELERATION,
    MAX_HAND_RETURN_ACCELERATION,
    MAX_REACH,
    MAX_TIP_DISTANCE,
    MIN_REACH,
    MIN_SOLVE_WEIGHT,
    THIGH_ACCELERATION,
)
from bunraku.marionette.elbow import Elbow
from bunraku.marionette.follower import Follower
from bunraku.marionette.handover import DirectionAlignment, JointBlend, return_acceleration
from bunraku.marionette.limb_rig import ArmRig, LegRig, Limb, Pose
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import lift_angle
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.vector import ZERO, JointRotations, Vector
from bunraku.motion.skeleton import Figure


class _ControlledLimb:
    """Common part of hands and legs: the position in the motion and the moving limb."""

    def __init__(self, solver: LimbSolver) -> None:
        self._solver = solver
        self._motion_position: Vector | None = None
        self._previous_position = ZERO
        self._velocity = self._previous_velocity = ZERO
        self._follower: Follower | None = None
        self._return_acceleration: float | None = None

    @property
    def motion_position(self) -> Vector:
        """Position of the limb in the last observed pose of the motion."""
        return self._motion_position or ZERO

    @property
    def is_controlled(self) -> bool:
        """True if the limb differs from the motion."""
        return self._follower is not None

    @property
    def position(self) -> Vector:
        """Shown position of the limb."""
        return self.motion_position if self._follower is None else self._follower.position

    @property
    def speed(self) -> float:
        """Speed in arm lengths, or radians, per second."""
        return 0.0 if self._follower is None else vector.length(self._follower.velocity)

    def use_solver(self, solver: LimbSolver) -> None:
        """Use another solver from the next frame on."""
        self._solver = solver
        if self._follower is not None:
            self._follower.solver = solver

    def _record_position(self, position: Vector, seconds: float) -> None:
        self._previous_position = self._motion_position or position
        self._previous_velocity = self._velocity
        moved = vector.subtract(position, self._previous_position)
        self._velocity = vector.scale(moved, 1.0 / seconds) if seconds > 0.0 else ZERO
        self._motion_position = position

    def _ensure_follower(self) -> Follower:
        """Return the follower, which starts with the position and velocity of the motion a frame ago."""
        if self._follower is None:
            self._follower = Follower(self._previous_position, self._previous_velocity, self._solver)
        return self._follower

    def _choose_return_acceleration(self, max_acceleration: float) -> float:
        """Return the acceleration of the return to the motion, chosen once when the limb is released."""
        if self._return_acceleration is None:
            follower = self._ensure_follower()
            distance = vector.length(vector.subtract(follower.position, self._previous_position))
            speed = vector.length(vector.subtract(follower.velocity, self._velocity))
            self._return_acceleration = return_acceleration(distance, speed, max_acceleration)
        return self._return_acceleration


class ControlledHand(_ControlledLimb):
    """One hand of a figure."""

    def __init__(self, figure: Figure, limb: Limb, solver: LimbSolver = PYTHON_SOLVER) -> None:
        """Raise `ProportionsError` for an arm whose bones are too short."""
        super().__init__(solver)
        self.rig = ArmRig(figure, limb, solver)
        self.reset()

    def reset(self) -> None:
        """Return to the motion at once and forget the state."""
        self._follower = self._return_acceleration = None
        self._elbow = Elbow(self.rig.arm, self.rig.shoulder, self._solver)
        self._alignment = DirectionAlignment()
        self._blend = ArmBlend(self.rig)

    def use_solver(self, solver: LimbSolver) -> None:
        """Use another solver from the next frame on."""
        super().use_solver(solver)
        self.rig.solver = self._elbow.solver = solver
        self._blend.use_solver(solver)

    def observe_pose(self, pose: Pose, seconds: float) -> None:
        """Observe the motion's pose, `seconds` after the last one."""
        self._record_position(self.rig.tip_target(self.rig.pose_joints(pose)), seconds)

    def solve_joints(self, pose: Pose, goal: Vector | None, weight: float, seconds: float) -> JointRotations | None:
        """Return the arm's joints, `seconds` after the last call, or None once the hand is back in the motion.

        `pose` is the last observed pose. The hand moves towards `goal`, or back to the motion if that is None. `weight`
        (0..1) is the weight of the solver's joints against the motion's.
        """
        rig, follower, own = self.rig, self._ensure_follower(), self.motion_position
        if goal is not None:
            self._return_acceleration = None
            reach = min(max(vector.length(goal), MIN_REACH), MAX_REACH)
            goal = vector.scale(rig.target_direction(goal), reach)
            hand = follower.step(goal, seconds, HAND_ACCELERATION, rig.arm.min_tip_distance, MAX_TIP_DISTANCE)
        else:
            acceleration = self._choose_return_acceleration(MAX_HAND_RETURN_ACCELERATION)
            # the hand of the motion may be nearer to the shoulder than a controlled hand can be
            inner = min(rig.arm.min_tip_distance, vector.length(own))
            hand = follower.step(own, seconds, acceleration, inner, 1.0, self._velocity)
            if weight <= 0.0 and vector.length(vector.subtract(hand, own)) < ARRIVAL_TOLERANCE:
                return None
        return self._solve_at(pose, hand, weight, seconds)

    def next_motion(self, seconds: float) -> HandMotion:
        """Return where the hand is `seconds` after the last call of `solve_joints` if nothing moves it."""
        if self._follower is None:
            return HandMotion(self.motion_position, self._velocity)
        velocity = self._follower.velocity
        return HandMotion(vector.add(self._follower.position, vector.scale(velocity, seconds)), velocity)

    def reachable_place(self, pose: Pose, place: Vector, seconds: float) -> Vector:
        """Return the place next to `place` that the arm reaches in the next `seconds`, within the shoulder's limit."""
        self._begin_elbow(pose)
        direction = self.rig.target_direction(place)
        return self._elbow.preview(direction, vector.length(place), self.rig.local_up(pose), seconds).tip

    def solve_bonded_joints(self, pose: Pose, place: Vector, weight: float, seconds: float) -> JointRotations:
        """Return the arm's joints as `solve_joints` does, with the hand moved to the place that its bond gives."""
        self._return_acceleration = None
        self._ensure_follower().move_to(place, seconds)
        return self._solve_at(pose, place, weight, seconds)

    def _begin_elbow(self, pose: Pose) -> None:
        if not self._elbow.has_begun:
            rig, joints = self.rig, self.rig.pose_joints(pose)
            elbow, chord = rig.joint_positions(joints)[0], rig.target_direction(self.motion_position)
            self._elbow.begin(chord, rig.plane_normal(joints), lift_angle(elbow, chord))

    def _solve_at(self, pose: Pose, hand: Vector, weight: float, seconds: float) -> JointRotations:
        rig, own = self.rig, self.motion_position
        motion_joints = rig.pose_joints(pose)
        self._begin_elbow(pose)
        tip, normal, bend = self._elbow.step(
            rig.target_direction(hand), vector.length(hand), rig.local_up(pose), seconds
        )
        solved = rig.bend_joints(vector.length(tip), bend)
        # the motion may hold an arm where the shoulder's limit forbids it: the limit is blended in with the weight
        target = vector.add(hand, vector.scale(vector.subtract(tip, hand), weight))
        alignment = self._alignment.update(own, target, weight)
        return self._blend.blend(
            motion_joints, solved, target, alignment, normal, max(weight, MIN_SOLVE_WEIGHT), seconds
        )


class ControlledLeg(_ControlledLimb):
    """One leg of a figure."""

    def __init__(self, figure: Figure, limb: Limb, solver: LimbSolver = PYTHON_SOLVER) -> None:
        super().__init__(solver)
        self.rig = LegRig(figure, limb)
        self.reset()

    def reset(self) -> None:
        """Return to the motion at once and forget the state."""
        self._follower = self._return_acceleration = None
        self._blend = JointBlend()

    def observe_pose(self, pose: Pose, seconds: float) -> None:
        """Observe the motion's pose, `seconds` after the last one."""
        self._record_position((self.rig.thigh_angle(pose, self.motion_position[0]), 0.0, 0.0), seconds)

    def solve_joints(self, pose: Pose, goal: Vector | None, weight: float, seconds: float) -> JointRotations | None:
        """Return the leg's joints, as `ControlledHand.solve_joints` does."""
        follower, own = self._ensure_follower(), self.motion_position
        if goal is not None:
            self._return_acceleration = None
            theta = follower.step(goal, seconds, THIGH_ACCELERATION)[0]
        else:
            acceleration = self._choose_return_acceleration(THIGH_ACCELERATION)
            theta = follower.step(own, seconds, acceleration, frame_velocity=self._velocity)[0]
            if weight <= 0.0 and abs(theta - own[0]) < ARRIVAL_TOLERANCE:
                return None
        return self._blend.blend(self.rig.pose_joints(pose), self.rig.solve(theta, pose), max(weight, MIN_SOLVE_WEIGHT))
