"""Body extension: spine, neck and clavicles of a performer, beside the figure's channels (proto/codec.md, 2.17).

The figure of LOA-1 has one joint between root and shoulders. An extension adds up to four joints of the spine, the neck
and both clavicles, by their names of H-Anim LOA-2. Each rotates as a linear function of the figure's own pose (its
driver) and a correction. So a clavicle follows the arm, also one that a puppeteer holds.

Legs and hands keep their places and orientations. Upper arms and forearms start at the extended shoulder and elbow, and
end on the line of the figure's bone: if the figure was fitted to a source, that is where the source's joint is.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure

MAX_SPINE_JOINTS = 4
SPINE_NAMES: tuple[tuple[str, ...], ...] = (
    (),
    ("vl5",),
    ("vl5", "vt10"),
    ("vl5", "vl1", "vt10"),
    ("vl5", "vl1", "vt10", "vt6"),
)
"""Names of the spine's joints, by their number; with any, they take the place of the figure's own vl5."""
NECK_NAME = "vc4"
CLAVICLE_NAMES = "l_sternoclavicular", "r_sternoclavicular"
LENGTH_UNIT_M = 5e-4
DRIVE_UNIT = 2.0**-5
REST_UNIT_RAD = 2.0**-9
"""Units of the integers that describe an extension."""

_ROOT, _VL5, _HEAD = 0, JOINT_INDEX["vl5"], JOINT_INDEX["skullbase"]
_SHOULDERS = JOINT_INDEX["l_shoulder"], JOINT_INDEX["r_shoulder"]
_TINY_M = 1e-9
"""Length below which a bone has no direction."""


class JointKind(Enum):
    """What a joint of an extension is: it decides the joint's parent and driver."""

    SPINE = "spine"
    NECK = "neck"
    LEFT_CLAVICLE = "left clavicle"
    RIGHT_CLAVICLE = "right clavicle"


@dataclass(frozen=True, slots=True)
class BodyExtension:
    """Joints of an extension, E in all: those of the spine upwards, then the neck, then both clavicles.

    The chest is the last joint of the spine, or the root. It is the parent of neck and clavicles. `offsets` (E, 3) are
    the joints' positions from their parents, in metres at rest; `ends` (3, 3) those of skullbase, left and right
    shoulder from the neck and the clavicles, or from the chest where these are missing.

    The rotation of a joint is exp(`drive` f + `rest` + v), of the spine in the root's frame, of others in the chest's:
    `drive` (E, 3, 3) applies to the driver f, `rest` (E, 3) is in radians, and v is the joint's value.
    """

    spine_count: int
    has_neck: bool
    has_clavicles: bool
    offsets: Array
    ends: Array
    drive: Array
    rest: Array

    @property
    def kinds(self) -> list[JointKind]:
        """Kind of each joint."""
        kinds = [JointKind.SPINE] * self.spine_count
        kinds += [JointKind.NECK] * self.has_neck
        return kinds + [JointKind.LEFT_CLAVICLE, JointKind.RIGHT_CLAVICLE] * self.has_clavicles

    @property
    def names(self) -> tuple[str, ...]:
        """H-Anim name of each joint."""
        neck = (NECK_NAME,) if self.has_neck else ()
        return SPINE_NAMES[self.spine_count] + neck + (CLAVICLE_NAMES if self.has_clavicles else ())


class ExtendedPose(NamedTuple):
    """World positions and orientations of all joints at n instants.

    `positions` (n, 18, 3) and `orientations` (n, 18, 4) are those of the figure's joints, `extra_positions` (n, E, 3)
    and `extra_orientations` (n, E, 4) those of the extension's.
    """

    positions: Array
    orientations: Array
    extra_positions: Array
    extra_orientations: Array


def find_driver(kind: JointKind, positions: Array, orientations: Array, chest: Array) -> Array:
    """Return the driver (n, 3) of a joint: what its rotation is a linear function of.

    Args:
        kind: Kind of the joint.
        positions: World positions (n, 18, 3) of the figure's joints.
        orientations: Their orientations (n, 18, 4).
        chest: Orientation (n, 4) of the extension's chest.

    Returns:
        For the spine, the rotation vector of vl5 in the root; for the neck, that of skullbase in the chest; for a
        clavicle, the direction of the upper arm in vl5.
    """
    if kind is JointKind.SPINE:
        return _relative_rotation(orientations[:, _ROOT], orientations[:, _VL5])
    if kind is JointKind.NECK:
        return _relative_rotation(chest, orientations[:, _HEAD])
    shoulder = _SHOULDERS[kind is JointKind.RIGHT_CLAVICLE]
    upper_arm = _direction(positions[:, shoulder + 1] - positions[:, shoulder])
    return rotation.rotate(rotation.conjugate(orientations[:, _VL5]), upper_arm)


def extend_pose(
    figure: Figure, extension: BodyExtension, positions: Array, orientations: Array, values: Array
) -> ExtendedPose:
    """Return the extended pose of a figure.

    Args:
        figure: Figure of the performer.
        extension: Its extension.
        positions: World positions (n, 18, 3) of the figure's joints, metres.
        orientations: Their orientations (n, 18, 4).
        values: Values (n, E, 3) of the extension, radians.
    """
    extended = ExtendedPose(
        positions.copy(),
        orientations.copy(),
        np.empty((len(positions), len(extension.offsets), 3)),
        np.empty((len(positions), len(extension.offsets), 4)),
    )
    start, frame = chest = positions[:, _ROOT], orientations[:, _ROOT]
    ends = dict.fromkeys((_HEAD, *_SHOULDERS), chest)
    for index, kind in enumerate(extension.kinds):
        if kind is not JointKind.SPINE:
            start, frame = chest
        place = start + rotation.rotate(frame, extension.offsets[index])
        driver = find_driver(kind, positions, orientations, chest[1])
        turn = driver @ extension.drive[index].T + extension.rest[index] + values[:, index]
        parent = orientations[:, _ROOT] if kind is JointKind.SPINE else chest[1]
        joint = place, rotation.multiply(parent, rotation.from_rotation_vector(turn))
        extended.extra_positions[:, index], extended.extra_orientations[:, index] = joint
        if kind is JointKind.SPINE:
            start, frame = chest = joint
            ends = dict.fromkeys(ends, chest)
        else:
            ends[{JointKind.NECK: _HEAD}.get(kind, _SHOULDERS[kind is JointKind.RIGHT_CLAVICLE])] = joint
    for joint_index, offset in zip((_HEAD, *_SHOULDERS), extension.ends, strict=True):
        carrier, carried = ends[joint_index]
        extended.positions[:, joint_index] = carrier + rotation.rotate(carried, offset)
    for shoulder in _SHOULDERS:
        _extend_arm(figure, extended, positions, shoulder)
    return extended


def _extend_arm(figure: Figure, extended: ExtendedPose, positions: Array, shoulder: int) -> None:
    """Move elbow and wrist of an arm to the extended shoulder, and turn upper arm and forearm."""
    for joint in (shoulder, shoulder + 1):
        start = extended.positions[:, joint]
        length = float(np.linalg.norm(figure.offsets[joint + 1]))
        end = meet_bone(positions[:, joint], positions[:, joint + 1], start, length)
        before, after = positions[:, joint + 1] - positions[:, joint], end - start
        extended.positions[:, joint + 1] = end
        extended.orientations[:, joint] = rotation.normalise(
            rotation.multiply(rotation.rotation_between(before, after), extended.orientations[:, joint])
        )


def meet_bone(bone_start: Array, bone_end: Array, start: Array, length: float) -> Array:
    """Return the end (n, 3) of a bone of this length from `start` (n, 3) that lies on the line of another bone.

    The line goes from `bone_start` through `bone_end`. A line that is too far away gives the direction of its nearest
    point.
    """
    along = _direction(bone_end - bone_start)
    apart = start - bone_start
    nearest = np.sum(apart * along, axis=-1, keepdims=True)
    rest = nearest**2 - np.sum(apart * apart, axis=-1, keepdims=True) + length * length
    ahead = bone_start + (nearest + np.sqrt(np.maximum(rest, 0.0))) * along - start
    distance = np.linalg.norm(ahead, axis=-1, keepdims=True)
    direction = np.where(distance > _TINY_M, ahead / np.maximum(distance, _TINY_M), along)
    met: Array = start + length * direction
    return met


def _direction(v: Array) -> Array:
    unit: Array = v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), _TINY_M)
    return unit


def _relative_rotation(frame: Array, orientation: Array) -> Array:
    return rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(frame), orientation))
