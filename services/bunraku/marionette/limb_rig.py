"""Limbs of a figure: from a target to the local rotations of three joints, and back.

The target of an arm is the hand tip in the shoulder's frame (axes of vl5, origin at the shoulder joint), in arm
lengths. The target of a leg is the angle of its thigh from straight down, in the vertical plane that the hips face. Arm
and shank hang in the world: gravity is world -y.

Each bone has an orientation whose x axis lies along the bone and whose z axis is the axis of the joint's bend. A rest
frame is this orientation at rest, so that a bone's rotation is (orientation now) * (rest frame)^-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from math import atan2, pi

from bunraku.marionette.arm import Arm
from bunraku.marionette.bend_table import load_bend_table
from bunraku.marionette.leg import clamp_thigh, knee_bend
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import elevation, vertical_normal
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.shoulder import make_shoulder_limit
from bunraku.marionette.solver.vector import JointRotations, Quaternion, Vector
from bunraku.motion.skeleton import JOINT_INDEX, Figure

Pose = Sequence[Sequence[float]]
"""18 local rotations w x y z, in the order of `skeleton.JOINTS`."""

UP: Vector = (0.0, 1.0, 0.0)
FORWARDS: Vector = (0.0, 0.0, 1.0)
BEND_AXIS: Vector = (-1.0, 0.0, 0.0)
"""At rest, a rotation about this axis lifts the lower end of an elbow or a thigh forwards."""


class Limb(IntEnum):
    """Limb that can be controlled; the numbers are those of the contract."""

    LEFT_HAND = 0
    RIGHT_HAND = 1
    LEFT_LEG = 2
    RIGHT_LEG = 3

    @property
    def is_hand(self) -> bool:
        """True if the target is a position; the target of a leg is an angle."""
        return self in (Limb.LEFT_HAND, Limb.RIGHT_HAND)

    @property
    def joint_indices(self) -> tuple[int, int, int]:
        """Indices of the limb's three joints in `skeleton.JOINTS`."""
        side = "l" if self in (Limb.LEFT_HAND, Limb.LEFT_LEG) else "r"
        a, b, c = ("shoulder", "elbow", "wrist") if self.is_hand else ("hip", "knee", "ankle")
        return (JOINT_INDEX[f"{side}_{a}"], JOINT_INDEX[f"{side}_{b}"], JOINT_INDEX[f"{side}_{c}"])


ALL_LIMBS = tuple(Limb)
"""All four in order. Iterating over a tuple is ten times faster than over an enumeration."""


def bone_frame(bone: Vector, axis: Vector) -> Quaternion:
    """Return the orientation with x along the bone and z the part of `axis` perpendicular to it."""
    x = vector.unit(bone, (0.0, -1.0, 0.0))
    z = vector.unit(vector.reject_from(axis, x), vector.any_perpendicular(x))
    return vector.from_columns(x, vector.cross(z, x), z)


def joint_rotation(pose: Pose, joint: int) -> Quaternion:
    """Return the local rotation of one joint."""
    w, x, y, z = pose[joint]
    return (w, x, y, z)


class ArmRig:
    """One arm of a figure. `bones` are its three bones at rest, in metres."""

    def __init__(self, figure: Figure, limb: Limb, solver: LimbSolver = PYTHON_SOLVER) -> None:
        """Raise `ProportionsError` for an arm whose bones are too short."""
        self.solver = solver
        _, elbow, wrist = self.joint_indices = limb.joint_indices
        self.bones = (_bone_offset(figure, elbow), _bone_offset(figure, wrist), _bone_offset(figure, wrist, tip=True))
        upper, fore, hand = (vector.length(link) for link in self.bones)
        self.arm_length_m = upper + fore + hand
        proportions = Proportions.from_links((upper, fore, hand))
        # the lengths are exactly the figure's; only the bend comes from the nearest table
        self.arm = Arm(proportions, load_bend_table(proportions.identity))
        self._trunk = _bone_offset(figure, JOINT_INDEX["vl5"])
        self._shoulder_offset = _bone_offset(figure, self.joint_indices[0])
        first, second, third = self.bones
        self.rest_frames = (bone_frame(first, BEND_AXIS), bone_frame(second, BEND_AXIS), bone_frame(third, BEND_AXIS))
        self.shoulder = make_shoulder_limit(right=limb is Limb.RIGHT_HAND)
        side = 1.0 if limb is Limb.LEFT_HAND else -1.0
        # the palm turns down as the wrist bends, because a wrist bends little to the side
        self.palm_turn_rad = side * pi / 2.0

    def local_up(self, pose: Pose) -> Vector:
        """Return the world's up in the shoulder's frame."""
        chest = vector.multiply(joint_rotation(pose, 0), joint_rotation(pose, JOINT_INDEX["vl5"]))
        return vector.rotate(vector.conjugate(chest), UP)

    def shoulder_frame(self, root: Vector, pose: Pose) -> tuple[Vector, Quaternion]:
        """Return position and orientation of the shoulder's frame, for a pose with its root at `root` (metres)."""
        whole = joint_rotation(pose, 0)
        chest = vector.multiply(whole, joint_rotation(pose, JOINT_INDEX["vl5"]))
        trunk = vector.add(root, vector.rotate(whole, self._trunk))
        return vector.add(trunk, vector.rotate(chest, self._shoulder_offset)), chest

    def joint_positions(self, joints: JointRotations) -> tuple[Vector, Vector, Vector]:
        """Return elbow, wrist and tip relative to the shoulder, in metres on the axes of vl5."""
        return self.solver.joint_positions(self.bones, joints)

    def pose_joints(self, pose: Pose) -> JointRotations:
        """Return the arm's three rotations in a pose."""
        a, b, c = self.joint_indices
        return (joint_rotation(pose, a), joint_rotation(pose, b), joint_rotation(pose, c))

    def tip_target(self, joints: JointRotations) -> Vector:
        """Return the position of the hand tip in arm lengths, which is the target for these joints."""
        return vector.scale(self.joint_positions(joints)[2], 1.0 / self.arm_length_m)

    def plane_normal(self, joints: JointRotations) -> Vector:
        """Return the normal of the arm's plane, not of unit length.

        It comes from the bend of the arm, and from the elbow's axis if the arm is straight.
        """
        elbow, _, tip = self.joint_positions(joints)
        across = vector.scale(vector.cross(elbow, tip), 1.0 / (self.arm_length_m * self.arm_length_m))
        return vector.add(across, vector.scale(vector.rotate(joints[0], BEND_AXIS), 0.1))

    def target_direction(self, target: Vector) -> Vector:
        """Return the unit vector to the target; straight down for the shoulder itself."""
        return vector.unit(target, (0.0, -1.0, 0.0))

    def chord_frame(self, direction: Vector, normal: Vector) -> Quaternion:
        """Return the frame with x the unit `direction` to the tip and z the unit `normal`, perpendicular to it."""
        return vector.from_columns(direction, vector.cross(normal, direction), normal)

    def bend_joints(self, reach: float, bend: float) -> JointRotations:
        """Return the joints with the tip at distance `reach` (arm lengths) and the wrist bent by `bend` radians.

        The first is relative to the frame of the chord: that frame times it is the shoulder's rotation.
        """
        return self.solver.bend_links(self.arm.geometry, self.rest_frames, self.palm_turn_rad, reach, bend)

    def solve(self, target: Vector, up: Vector, normal: Vector | None = None) -> JointRotations:
        """Return the joints with the tip at `target`, bent by gravity alone in the plane of `normal`.

        `up` is the world's up and `normal` the axis of the elbow's bend, unit vectors on the axes of vl5; `normal` is
        perpendicular to the target and defaults to that of the vertical plane. A target out of reach is moved into
        reach along its direction.
        """
        direction = self.target_direction(target)
        if normal is None:
            normal = vertical_normal(direction, up)
        if normal is None:
            ahead = vector.unit(vector.reject_from(FORWARDS, up), UP)
            normal = vector.unit(
                vector.reject_from(vector.cross(ahead, up), direction), vector.any_perpendicular(direction)
            )
        reach = self.arm.clamp_distance(vector.length(target))
        shoulder, elbow, wrist = self.bend_joints(reach, self.arm.gravity_bend(reach, elevation(direction, up)))
        return (vector.normalise(vector.multiply(self.chord_frame(direction, normal), shoulder)), elbow, wrist)


class LegRig:
    """One leg of a figure."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        _, knee, ankle = self.joint_indices = limb.joint_indices
        self.thigh = _bone_offset(figure, knee)
        thigh = bone_frame(self.thigh, BEND_AXIS)
        shank = bone_frame(_bone_offset(figure, ankle), BEND_AXIS)
        self._thigh_inverse = vector.conjugate(thigh)
        self._thigh_frame = thigh
        self._shank_inverse = vector.conjugate(shank)
        # the ankle is fixed as in standing: the foot is level when the shank is vertical
        standing = vector.from_columns((0.0, -1.0, 0.0), FORWARDS, BEND_AXIS)
        self._ankle = vector.normalise(vector.multiply(shank, vector.conjugate(standing)))

    def pose_joints(self, pose: Pose) -> JointRotations:
        """Return the leg's three rotations in a pose."""
        a, b, c = self.joint_indices
        return (joint_rotation(pose, a), joint_rotation(pose, b), joint_rotation(pose, c))

    def hip_facing(self, pose: Pose) -> tuple[Quaternion, Vector]:
        """Return the world orientation of the hips and the horizontal unit vector that they face."""
        hips = vector.multiply(joint_rotation(pose, 0), joint_rotation(pose, JOINT_INDEX["sacroiliac"]))
        # perpendicular to the hips' lateral axis, so that a somersault does not reverse it; on the side, their front
        across = vector.cross(vector.rotate(hips, (1.0, 0.0, 0.0)), UP)
        ahead = vector.add(across, vector.scale(vector.rotate(hips, FORWARDS), 0.05))
        level = vector.unit((ahead[0], 0.0, ahead[2]), FORWARDS)
        return hips, level

    def thigh_angle(self, pose: Pose, reference_angle: float = 0.0) -> float:
        """Return the thigh's angle in the vertical plane that the hips face, forwards from straight down, in radians.

        It is within the limits of a thigh. A thigh beyond them is at the limit that is nearer to `reference_angle`.
        """
        hips, level = self.hip_facing(pose)
        thigh = vector.rotate(vector.multiply(hips, joint_rotation(pose, self.joint_indices[0])), self.thigh)
        theta = atan2(vector.dot(thigh, level), -thigh[1])
        return clamp_thigh(theta + 2.0 * pi * round((reference_angle - theta) / (2.0 * pi)))

    def solve(self, theta: float, pose: Pose) -> JointRotations:
        """Return the joints with the thigh at `theta` radians in the plane that the hips face and the shank hanging."""
        hips, level = self.hip_facing(pose)
        theta = clamp_thigh(theta)
        upright = vector.from_columns(level, UP, vector.cross(level, UP))
        thigh = vector.multiply(vector.multiply(upright, vector.about_z(theta - pi / 2.0)), self._thigh_inverse)
        knee = vector.multiply(
            vector.multiply(self._thigh_frame, vector.about_z(-knee_bend(theta))), self._shank_inverse
        )
        hip = vector.normalise(vector.multiply(vector.conjugate(hips), thigh))
        return (hip, vector.normalise(knee), self._ankle)


def _bone_offset(figure: Figure, joint: int, *, tip: bool = False) -> Vector:
    x, y, z = (figure.tips if tip else figure.offsets)[joint].tolist()
    return (x, y, z)
