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
from bunraku.marionette.elbow import elevation, vertical_normal
from bunraku.marionette.leg import clamp_thigh, knee_bend
from bunraku.marionette.links import Links, close
from bunraku.marionette.proportions import WRIST_LIMIT, Proportions
from bunraku.marionette.shoulder import shoulder_of
from bunraku.marionette.table import table_of
from bunraku.marionette.vector import Quaternion, Vector
from bunraku.motion.skeleton import INDEX, Figure

Pose = Sequence[Sequence[float]]
"""18 local rotations w x y z, in the order of `skeleton.JOINTS`."""
Joints = tuple[Quaternion, Quaternion, Quaternion]
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
    def joints(self) -> tuple[int, int, int]:
        """Indices of the limb's three joints in `skeleton.JOINTS`."""
        side = "l" if self in (Limb.LEFT_HAND, Limb.LEFT_LEG) else "r"
        a, b, c = ("shoulder", "elbow", "wrist") if self.is_hand else ("hip", "knee", "ankle")
        return (INDEX[f"{side}_{a}"], INDEX[f"{side}_{b}"], INDEX[f"{side}_{c}"])


LIMBS = tuple(Limb)
"""All four, in order: to go through an enumeration takes ten times as long, which counts at a stage's rate."""


def link_frame(link: Vector, axis: Vector) -> Quaternion:
    """Orientation with x along `link` and z as near to `axis` as square to it allows."""
    x = vector.unit(link, (0.0, -1.0, 0.0))
    z = vector.unit(vector.square_to(axis, x), vector.across(x))
    return vector.from_columns(x, vector.cross(z, x), z)


def joint_rotation(pose: Pose, joint: int) -> Quaternion:
    """The local rotation of one joint."""
    w, x, y, z = pose[joint]
    return (w, x, y, z)


class ArmRig:
    """One arm of a figure. `links` are its three bones at rest (metres), `scale` the arm's length (metres)."""

    def __init__(self, figure: Figure, limb: Limb) -> None:
        """Raises `ProportionsError` for an arm whose bones are too short to hang."""
        _, elbow, wrist = self.joints = limb.joints
        self.links = (_row(figure, elbow), _row(figure, wrist), _row(figure, wrist, tip=True))
        upper, fore, hand = (vector.length(link) for link in self.links)
        self.scale = upper + fore + hand
        proportions = Proportions.of((upper, fore, hand))
        # the lengths are the figure's own, to the last digit; only the bend comes from the nearest table
        self.arm = Arm(proportions, table_of(proportions.identity))
        first, second, third = self.links
        self.frames = (link_frame(first, BEND_AXIS), link_frame(second, BEND_AXIS), link_frame(third, BEND_AXIS))
        self.shoulder = shoulder_of(right=limb is Limb.RIGHT_HAND)
        side = 1.0 if limb is Limb.LEFT_HAND else -1.0
        # the more the wrist bends, the more the palm turns down: to the side a wrist bends little
        self.palm_down = side * pi / 2.0

    def up(self, pose: Pose) -> Vector:
        """The world's up in the shoulder's frame."""
        chest = vector.multiply(joint_rotation(pose, 0), joint_rotation(pose, INDEX["vl5"]))
        return vector.rotate(vector.conjugate(chest), UP)

    def places(self, joints: Joints) -> tuple[Vector, Vector, Vector]:
        """Elbow, wrist and tip from the shoulder, in metres on the axes of vl5."""
        return places(self.links, joints)

    def dance(self, pose: Pose) -> Joints:
        """The arm's three rotations in a pose."""
        a, b, c = self.joints
        return (joint_rotation(pose, a), joint_rotation(pose, b), joint_rotation(pose, c))

    def target(self, joints: Joints) -> Vector:
        """Where the hand tip is, in arm lengths: the target that asks for this place."""
        return vector.scale(self.places(joints)[2], 1.0 / self.scale)

    def bend_axis(self, joints: Joints) -> Vector:
        """The normal of the plane the arm lies in, not of unit length: from its bend, and where it is straight from
        the elbow's axis."""
        elbow, _, tip = self.places(joints)
        across = vector.scale(vector.cross(elbow, tip), 1.0 / (self.scale * self.scale))
        return vector.add(across, vector.scale(vector.rotate(joints[0], BEND_AXIS), 0.1))

    def direction(self, target: Vector) -> Vector:
        """Unit vector to the target; straight down for the shoulder itself."""
        return vector.unit(target, (0.0, -1.0, 0.0))

    def chord(self, direction: Vector, normal: Vector) -> Quaternion:
        """The frame of an arm's plane: x the unit `direction` to the tip, z the unit `normal`, square to it."""
        return vector.from_columns(direction, vector.cross(normal, direction), normal)

    def bend(self, reach: float, bend: float) -> Joints:
        """The arm that reaches as far as `reach` (arm lengths) with its wrist bent by `bend` radians, in the frame of
        its chord: that frame times the first is the shoulder's rotation."""
        return bend_links(self.arm.links, self.frames, self.palm_down, reach, bend)

    def hang(self, target: Vector, up: Vector, normal: Vector | None = None) -> Joints:
        """The arm with its tip at `target` as gravity alone has it, in the plane of `normal` (by default the vertical).

        `up` is the world's up and `normal` the axis of the elbow's bend, unit vectors on the axes of vl5; `normal` is
        square to the target. A target out of reach is brought in, its direction kept.
        """
        direction = self.direction(target)
        if normal is None:
            normal = vertical_normal(direction, up)
        if normal is None:
            ahead = vector.unit(vector.square_to(FORWARDS, up), UP)
            normal = vector.unit(vector.square_to(vector.cross(ahead, up), direction), vector.across(direction))
        reach = self.arm.clamp(vector.length(target))
        shoulder, elbow, wrist = self.bend(reach, self.arm.bend(reach, elevation(direction, up)))
        return (vector.normalise(vector.multiply(self.chord(direction, normal), shoulder)), elbow, wrist)


def places(bones: tuple[Vector, Vector, Vector], joints: Joints) -> tuple[Vector, Vector, Vector]:
    """As `ArmRig.places`, of these bones at rest."""
    upper, fore, hand = bones
    elbow = vector.rotate(joints[0], upper)
    turn = vector.multiply(joints[0], joints[1])
    wrist = vector.add(elbow, vector.rotate(turn, fore))
    return elbow, wrist, vector.add(wrist, vector.rotate(vector.multiply(turn, joints[2]), hand))


def bend_links(links: Links, frames: Joints, palm_down: float, reach: float, bend: float) -> Joints:
    """As `ArmRig.bend`, of an arm with these `links` and `frames`, whose palm turns by `palm_down` radians as its wrist
    bends to its limit."""
    t0, t1, t2 = close(links, reach, 0.0, bend)
    first, second, third = frames
    share = (t2 - t1) / WRIST_LIMIT
    palm = vector.about((1.0, 0.0, 0.0), palm_down * share * share * (3.0 - 2.0 * share))
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
        _, knee, ankle = self.joints = limb.joints
        self.thigh = _row(figure, knee)
        thigh = link_frame(self.thigh, BEND_AXIS)
        shank = link_frame(_row(figure, ankle), BEND_AXIS)
        self._thigh_inverse = vector.conjugate(thigh)
        self._thigh_frame = thigh
        self._shank_inverse = vector.conjugate(shank)
        # the foot is level when the shank hangs plumb: fixed to the shank as standing has it
        plumb = vector.from_columns((0.0, -1.0, 0.0), FORWARDS, BEND_AXIS)
        self._ankle = vector.normalise(vector.multiply(shank, vector.conjugate(plumb)))

    def dance(self, pose: Pose) -> Joints:
        """The leg's three rotations in a pose."""
        a, b, c = self.joints
        return (joint_rotation(pose, a), joint_rotation(pose, b), joint_rotation(pose, c))

    def facing(self, pose: Pose) -> tuple[Quaternion, Vector]:
        """The world's orientation of the hips, and the level unit vector they face."""
        hips = vector.multiply(joint_rotation(pose, 0), joint_rotation(pose, INDEX["sacroiliac"]))
        # square to the hips' own axis, so that a somersault turns nothing; lying on a side, where they face
        across = vector.cross(vector.rotate(hips, (1.0, 0.0, 0.0)), UP)
        ahead = vector.add(across, vector.scale(vector.rotate(hips, FORWARDS), 0.05))
        level = vector.unit((ahead[0], 0.0, ahead[2]), FORWARDS)
        return hips, level

    def angle(self, pose: Pose, near: float = 0.0) -> float:
        """The thigh's angle forwards from straight down, seen square to the vertical plane the hips face, within its
        limits. A thigh that points beyond them is at the one it is on the way round from `near`, radians."""
        hips, level = self.facing(pose)
        thigh = vector.rotate(vector.multiply(hips, joint_rotation(pose, self.joints[0])), self.thigh)
        theta = atan2(vector.dot(thigh, level), -thigh[1])
        return clamp_thigh(theta + 2.0 * pi * round((near - theta) / (2.0 * pi)))

    def hang(self, theta: float, pose: Pose) -> Joints:
        """The leg with its thigh at `theta` radians in the plane the hips face, the shank hanging, the ankle fixed."""
        hips, level = self.facing(pose)
        theta = clamp_thigh(theta)
        upright = vector.from_columns(level, UP, vector.cross(level, UP))
        thigh = vector.multiply(vector.multiply(upright, _about_z(theta - pi / 2.0)), self._thigh_inverse)
        knee = vector.multiply(vector.multiply(self._thigh_frame, _about_z(-knee_bend(theta))), self._shank_inverse)
        hip = vector.normalise(vector.multiply(vector.conjugate(hips), thigh))
        return (hip, vector.normalise(knee), self._ankle)


def _about_z(angle: float) -> Quaternion:
    return vector.about((0.0, 0.0, 1.0), angle)


def _row(figure: Figure, joint: int, *, tip: bool = False) -> Vector:
    x, y, z = (figure.tips if tip else figure.offsets)[joint].tolist()
    return (x, y, z)
