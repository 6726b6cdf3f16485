"""Limbs of a figure: from a target to the local rotations of three joints, and back.

An arm's target is the hand tip in the shoulder's frame (axes of vl5, origin at the shoulder joint), in arm lengths; a
leg's is the angle of its thigh from straight down, in the vertical plane the hips face. Arm and shank hang in the
world: gravity is world -y.

Each link gets an orientation whose x lies along the link and whose z is the axis of the joint's bend; `frame` below is
the same orientation at rest, so that a link's rotation is (orientation now) * (orientation at rest)^-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from math import atan2, pi

from bunraku.marionette import vector
from bunraku.marionette.arm import Arm
from bunraku.marionette.bend_table import load_bend_table
from bunraku.marionette.elbow import elevation, vertical_normal
from bunraku.marionette.leg import clamp_thigh, knee_bend
from bunraku.marionette.planar_arm import ArmGeometry, close_chain
from bunraku.marionette.proportions import MAX_WRIST_BEND_RAD, Proportions
from bunraku.marionette.shoulder import make_shoulder_limit
from bunraku.marionette.vector import Quaternion, Vector
from bunraku.motion.skeleton import JOINT_INDEX, Figure

Pose = Sequence[Sequence[float]]
"""18 local rotations w x y z, in the order of `skeleton.JOINTS`."""
JointRotations = tuple[Quaternion, Quaternion, Quaternion]
"""Local rotations of shoulder, elbow, wrist or hip, knee, ankle."""

UP: Vector = (0.0, 1.0, 0.0)
FORWARDS: Vector = (0.0, 0.0, 1.0)
BEND_AXIS: Vector = (-1.0, 0.0, 0.0)
"""At rest, turning about this lifts an elbow's or a thigh's lower end forwards."""


class Limb(IntEnum):
    """What can be pulled; the numbers are the contract's."""

    LEFT_HAND = 0
    RIGHT_HAND = 1
    LEFT_LEG = 2
    RIGHT_LEG = 3

    @property
    def is_hand(self) -> bool:
        """Whether the target is a place (else an angle)."""
        return self in (Limb.LEFT_HAND, Limb.RIGHT_HAND)

    @property
    def joint_indices(self) -> tuple[int, int, int]:
        """Indices of the limb's three joints in `skeleton.JOINTS`."""
        side = "l" if self in (Limb.LEFT_HAND, Limb.LEFT_LEG) else "r"
        a, b, c = ("shoulder", "elbow", "wrist") if self.is_hand else ("hip", "knee", "ankle")
        return (JOINT_INDEX[f"{side}_{a}"], JOINT_INDEX[f"{side}_{b}"], JOINT_INDEX[f"{side}_{c}"])


ALL_LIMBS = tuple(Limb)
"""All four, in order: to go through an enumeration takes ten times as long, which counts at a stage's rate."""


def bone_frame(bone: Vector, axis: Vector) -> Quaternion:
    """Orientation with x along `link` and z as near to `axis` as square to it allows."""
    x = vector.unit(bone, (0.0, -1.0, 0.0))
    z = vector.unit(vector.reject_from(axis, x), vector.any_perpendicular(x))
    return vector.from_columns(x, vector.cross(z, x), z)


def joint_rotation(pose: Pose, joint: int) -> Quaternion:
    """The local rotation of one joint."""
    w, x, y, z = pose[joint]
    return (w, x, y, z)


class ArmRig:
    """One arm of a figure. `links` are its three bones at rest (metres), `scale` the arm's length (metres)."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        """Raises `ProportionsError` for an arm whose bones are too short to hang."""
        _, elbow, wrist = self.joint_indices = limb.joint_indices
        self.bones = (_bone_offset(figure, elbow), _bone_offset(figure, wrist), _bone_offset(figure, wrist, tip=True))
        upper, fore, hand = (vector.length(link) for link in self.bones)
        self.arm_length_m = upper + fore + hand
        proportions = Proportions.from_links((upper, fore, hand))
        # the lengths are the figure's own, to the last digit; only the bend comes from the nearest table
        self.arm = Arm(proportions, load_bend_table(proportions.identity))
        first, second, third = self.bones
        self.rest_frames = (bone_frame(first, BEND_AXIS), bone_frame(second, BEND_AXIS), bone_frame(third, BEND_AXIS))
        self.shoulder = make_shoulder_limit(right=limb is Limb.RIGHT_HAND)
        side = 1.0 if limb is Limb.LEFT_HAND else -1.0
        # the more the wrist bends, the more the palm turns down: to the side a wrist bends little
        self.palm_turn_rad = side * pi / 2.0

    def local_up(self, pose: Pose) -> Vector:
        """The world's up in the shoulder's frame."""
        chest = vector.multiply(joint_rotation(pose, 0), joint_rotation(pose, JOINT_INDEX["vl5"]))
        return vector.rotate(vector.conjugate(chest), UP)

    def joint_positions(self, joints: JointRotations) -> tuple[Vector, Vector, Vector]:
        """Elbow, wrist and tip from the shoulder, in metres on the axes of vl5."""
        return joint_positions(self.bones, joints)

    def pose_joints(self, pose: Pose) -> JointRotations:
        """The arm's three rotations in a pose."""
        a, b, c = self.joint_indices
        return (joint_rotation(pose, a), joint_rotation(pose, b), joint_rotation(pose, c))

    def tip_target(self, joints: JointRotations) -> Vector:
        """Where the hand tip is, in arm lengths: the target that asks for this place."""
        return vector.scale(self.joint_positions(joints)[2], 1.0 / self.arm_length_m)

    def plane_normal(self, joints: JointRotations) -> Vector:
        """The normal of the plane the arm lies in, not of unit length: from its bend, and where it is straight from
        the elbow's axis."""
        elbow, _, tip = self.joint_positions(joints)
        across = vector.scale(vector.cross(elbow, tip), 1.0 / (self.arm_length_m * self.arm_length_m))
        return vector.add(across, vector.scale(vector.rotate(joints[0], BEND_AXIS), 0.1))

    def target_direction(self, target: Vector) -> Vector:
        """Unit vector to the target; straight down for the shoulder itself."""
        return vector.unit(target, (0.0, -1.0, 0.0))

    def chord_frame(self, direction: Vector, normal: Vector) -> Quaternion:
        """The frame of an arm's plane: x the unit `direction` to the tip, z the unit `normal`, square to it."""
        return vector.from_columns(direction, vector.cross(normal, direction), normal)

    def bend_joints(self, reach: float, bend: float) -> JointRotations:
        """The arm that reaches as far as `reach` (arm lengths) with its wrist bent by `bend` radians, in the frame of
        its chord: that frame times the first is the shoulder's rotation."""
        return bend_links(self.arm.geometry, self.rest_frames, self.palm_turn_rad, reach, bend)

    def solve(self, target: Vector, up: Vector, normal: Vector | None = None) -> JointRotations:
        """The arm with its tip at `target` as gravity alone has it, in the plane of `normal` (by default the vertical).

        `up` is the world's up and `normal` the axis of the elbow's bend, unit vectors on the axes of vl5; `normal` is
        square to the target. A target out of reach is brought in, its direction kept.
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


def joint_positions(bones: tuple[Vector, Vector, Vector], joints: JointRotations) -> tuple[Vector, Vector, Vector]:
    """As `ArmRig.places`, of these bones at rest."""
    upper, fore, hand = bones
    elbow = vector.rotate(joints[0], upper)
    turn = vector.multiply(joints[0], joints[1])
    wrist = vector.add(elbow, vector.rotate(turn, fore))
    return elbow, wrist, vector.add(wrist, vector.rotate(vector.multiply(turn, joints[2]), hand))


def bend_links(
    geometry: ArmGeometry, rest_frames: JointRotations, palm_turn_rad: float, reach: float, bend: float
) -> JointRotations:
    """As `ArmRig.bend`, of an arm with these `links` and `frames`, whose palm turns by `palm_down` radians as its wrist
    bends to its limit."""
    t0, t1, t2 = close_chain(geometry, reach, 0.0, bend)
    first, second, third = rest_frames
    share = (t2 - t1) / MAX_WRIST_BEND_RAD
    palm = vector.from_axis_angle((1.0, 0.0, 0.0), palm_turn_rad * share * share * (3.0 - 2.0 * share))
    elbow = vector.multiply(vector.multiply(_about_z(t1 - t0), palm), vector.conjugate(second))
    wrist = vector.multiply(vector.multiply(_about_z(t2 - t1), palm), vector.conjugate(third))
    return (
        vector.multiply(_about_z(t0), vector.conjugate(first)),
        vector.normalise(vector.multiply(first, elbow)),
        vector.normalise(vector.multiply(vector.multiply(second, vector.conjugate(palm)), wrist)),
    )


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
        # the foot is level when the shank hangs plumb: fixed to the shank as standing has it
        plumb = vector.from_columns((0.0, -1.0, 0.0), FORWARDS, BEND_AXIS)
        self._ankle = vector.normalise(vector.multiply(shank, vector.conjugate(plumb)))

    def pose_joints(self, pose: Pose) -> JointRotations:
        """The leg's three rotations in a pose."""
        a, b, c = self.joint_indices
        return (joint_rotation(pose, a), joint_rotation(pose, b), joint_rotation(pose, c))

    def hip_facing(self, pose: Pose) -> tuple[Quaternion, Vector]:
        """The world's orientation of the hips, and the level unit vector they face."""
        hips = vector.multiply(joint_rotation(pose, 0), joint_rotation(pose, JOINT_INDEX["sacroiliac"]))
        # square to the hips' own axis, so that a somersault turns nothing; lying on a side, where they face
        across = vector.cross(vector.rotate(hips, (1.0, 0.0, 0.0)), UP)
        ahead = vector.add(across, vector.scale(vector.rotate(hips, FORWARDS), 0.05))
        level = vector.unit((ahead[0], 0.0, ahead[2]), FORWARDS)
        return hips, level

    def thigh_angle(self, pose: Pose, reference_angle: float = 0.0) -> float:
        """The thigh's angle forwards from straight down, seen square to the vertical plane the hips face, within its
        limits. A thigh that points beyond them is at the one it is on the way round from `near`, radians."""
        hips, level = self.hip_facing(pose)
        thigh = vector.rotate(vector.multiply(hips, joint_rotation(pose, self.joint_indices[0])), self.thigh)
        theta = atan2(vector.dot(thigh, level), -thigh[1])
        return clamp_thigh(theta + 2.0 * pi * round((reference_angle - theta) / (2.0 * pi)))

    def solve(self, theta: float, pose: Pose) -> JointRotations:
        """The leg with its thigh at `theta` radians in the plane the hips face, the shank hanging, the ankle fixed."""
        hips, level = self.hip_facing(pose)
        theta = clamp_thigh(theta)
        upright = vector.from_columns(level, UP, vector.cross(level, UP))
        thigh = vector.multiply(vector.multiply(upright, _about_z(theta - pi / 2.0)), self._thigh_inverse)
        knee = vector.multiply(vector.multiply(self._thigh_frame, _about_z(-knee_bend(theta))), self._shank_inverse)
        hip = vector.normalise(vector.multiply(vector.conjugate(hips), thigh))
        return (hip, vector.normalise(knee), self._ankle)


def _about_z(angle: float) -> Quaternion:
    return vector.from_axis_angle((0.0, 0.0, 1.0), angle)


def _bone_offset(figure: Figure, joint: int, *, tip: bool = False) -> Vector:
    x, y, z = (figure.tips if tip else figure.offsets)[joint].tolist()
    return (x, y, z)
