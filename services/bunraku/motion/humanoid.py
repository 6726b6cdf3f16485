"""Figure as a Unity humanoid in the T-pose, whose bones have the orientation of the world at rest.

The mapping is that of the web client (`web/src/motion/humanoid.ts`). Hips is the sacroiliac, into which the root is
merged; Spine is vl5, Head is skullbase, and the joints of arms and legs have one bone each. Bones between these
(Chest, UpperChest, Neck, shoulders) are optional in avatars and do not rotate. They divide the figure's lengths, so
that a tool that applies positions places every joint of the figure exactly while the sacroiliac does not turn. When it
turns, the rotations of all bones stay exact, and the trunk is moved a little, because it hangs from the hips here and
from the root in the figure. UpperChest coincides with Chest, because many avatars have no UpperChest.

An extension turns Spine, Chest, Neck and the shoulders; UpperChest stays with Chest.

Frame: the figure's (`motion.skeleton`): right-handed, metres, y up, facing z, x to the left. Bone names are those of
Unity's HumanBodyBones.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.extension import BodyExtension, ExtendedPose, JointKind
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, PARENTS, Figure

_TABLE: tuple[tuple[str, str | None, str | None], ...] = (
    ("Hips", None, "sacroiliac"),
    ("LeftUpperLeg", "Hips", "l_hip"),
    ("LeftLowerLeg", "LeftUpperLeg", "l_knee"),
    ("LeftFoot", "LeftLowerLeg", "l_ankle"),
    ("LeftToes", "LeftFoot", "l_midtarsal"),
    ("RightUpperLeg", "Hips", "r_hip"),
    ("RightLowerLeg", "RightUpperLeg", "r_knee"),
    ("RightFoot", "RightLowerLeg", "r_ankle"),
    ("RightToes", "RightFoot", "r_midtarsal"),
    ("Spine", "Hips", "vl5"),
    ("Chest", "Spine", None),
    ("UpperChest", "Chest", None),
    ("Neck", "UpperChest", None),
    ("Head", "Neck", "skullbase"),
    ("LeftShoulder", "UpperChest", None),
    ("LeftUpperArm", "LeftShoulder", "l_shoulder"),
    ("LeftLowerArm", "LeftUpperArm", "l_elbow"),
    ("LeftHand", "LeftLowerArm", "l_wrist"),
    ("RightShoulder", "UpperChest", None),
    ("RightUpperArm", "RightShoulder", "r_shoulder"),
    ("RightLowerArm", "RightUpperArm", "r_elbow"),
    ("RightHand", "RightLowerArm", "r_wrist"),
)
BONES: tuple[str, ...] = tuple(name for name, _, _ in _TABLE)
"""Names of the bones; parents come before their children."""
BONE_PARENTS: tuple[int, ...] = tuple(-1 if parent is None else BONES.index(parent) for _, parent, _ in _TABLE)
BONE_JOINTS: dict[str, str] = {name: joint for name, _, joint in _TABLE if joint is not None}
"""Joint of the figure that each rotating bone follows."""

CHEST_SHARE = 0.4
"""Position of the chest, as a share of the way from vl5 to the middle of the shoulders."""
CLAVICLE_SHARE = 0.25
"""Position of a shoulder bone, as a share of the way from the middle of the shoulders to the shoulder joint."""

_SACROILIAC, _VL5 = JOINT_INDEX["sacroiliac"], JOINT_INDEX["vl5"]
_LEFT_SHOULDER, _RIGHT_SHOULDER = JOINT_INDEX["l_shoulder"], JOINT_INDEX["r_shoulder"]
_DRIVEN_BONES = [BONES.index(name) for name in BONE_JOINTS]
_DRIVEN_JOINTS = [JOINT_INDEX[joint] for joint in BONE_JOINTS.values()]

T_POSE_TO_REST: Array = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
"""Rotation (18, 4) of each joint's bone from the T-pose to the figure's rest pose: for an arm, 90 degrees about z."""
T_POSE_TO_REST[_LEFT_SHOULDER:_RIGHT_SHOULDER] = [np.sqrt(0.5), 0.0, 0.0, -np.sqrt(0.5)]
T_POSE_TO_REST[_RIGHT_SHOULDER:] = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]

# in their parent's frame; the hips' parent is the world
_PARENT_TO_REST: Array = T_POSE_TO_REST[list(PARENTS)].copy()
_PARENT_TO_REST[0] = rotation.IDENTITY


def bone_rotations(rotations: Array) -> Array:
    """Return the local rotations (..., 22, 4) of `BONES` from the T-pose, for joint rotations (..., 18, 4).

    The hips' rotation is in the world frame, that of others in their parent's.
    """
    joints = rotation.multiply(rotation.multiply(rotation.conjugate(_PARENT_TO_REST), rotations), T_POSE_TO_REST)
    root, hips = rotations[..., 0, :], rotations[..., _SACROILIAC, :]
    joints[..., _SACROILIAC, :] = rotation.multiply(root, hips)
    # the figure's spine hangs from the root
    joints[..., _VL5, :] = rotation.multiply(rotation.conjugate(hips), rotations[..., _VL5, :])
    bones = np.empty((*rotations.shape[:-2], len(BONES), 4))
    bones[...] = rotation.IDENTITY
    bones[..., _DRIVEN_BONES, :] = joints[..., _DRIVEN_JOINTS, :]
    return bones


def hips_position(figure: Figure, root: Array, rotations: Array) -> Array:
    """Return the world position (..., 3) of the hips, metres, for a root (..., 3) and joint rotations (..., 18, 4)."""
    position: Array = root + rotation.rotate(rotations[..., 0, :], figure.offsets[_SACROILIAC])
    return position


def rest_hips_position(figure: Figure) -> Array:
    """Return the position (3,) of the hips in the T-pose, metres, from the floor below the figure."""
    position: Array = figure.offsets[0] + figure.offsets[_SACROILIAC]
    return position


def bone_offsets(figure: Figure) -> Array:
    """Return the positions (22, 3) of `BONES` from their parents in the T-pose, metres; that of the hips is zero."""
    from_parent = rotation.rotate(rotation.conjugate(_PARENT_TO_REST), figure.offsets)
    from_hips = np.zeros((JOINT_COUNT, 3))
    from_hips[0] = -figure.offsets[_SACROILIAC]
    for joint in range(1, JOINT_COUNT):
        from_hips[joint] = from_hips[PARENTS[joint]] + from_parent[joint]
    middle = 0.5 * (from_hips[_LEFT_SHOULDER] + from_hips[_RIGHT_SHOULDER])
    chest = from_hips[_VL5] + CHEST_SHARE * (middle - from_hips[_VL5])
    positions = {"Chest": chest, "UpperChest": chest, "Neck": middle}
    for name, shoulder in (("LeftShoulder", _LEFT_SHOULDER), ("RightShoulder", _RIGHT_SHOULDER)):
        positions[name] = middle + CLAVICLE_SHARE * (from_hips[shoulder] - middle)
    positions |= {bone: from_hips[JOINT_INDEX[joint]] for bone, joint in BONE_JOINTS.items()}
    placed = np.stack([positions[bone] for bone in BONES])
    offsets: Array = placed - placed[list(BONE_PARENTS)]
    offsets[0] = 0.0
    return offsets


def extended_bones(extension: BodyExtension, pose: ExtendedPose) -> tuple[Array, Array]:
    """Return positions (22, 3) and rotations (22, 4) of `BONES` in their parents' frames, for a pose of one instant.

    The hips' position and rotation are in the world frame. Positions of other bones are constant, except between bones
    of the trunk that leave out joints of the spine.
    """
    positions, orientations = np.empty((len(BONES), 3)), np.empty((len(BONES), 4))
    joints, kinds = pose.positions[0], extension.kinds
    for index, (name, _, joint) in enumerate(_TABLE):
        if joint is not None and name != "Spine":
            number = JOINT_INDEX[joint]
            positions[index] = joints[number]
            orientations[index] = rotation.multiply(pose.orientations[0, number], T_POSE_TO_REST[number])
            continue
        kind = _EXTENDED_KINDS.get(name)
        extra = kinds.index(kind) if kind in kinds else extension.spine_count - 1
        extra = min(extra, 0) if name == "Spine" else extra
        if extra < 0:
            positions[index], orientations[index] = joints[0], pose.orientations[0, 0]
        else:
            positions[index], orientations[index] = pose.extra_positions[0, extra], pose.extra_orientations[0, extra]
    local_positions, local_rotations = positions.copy(), orientations.copy()
    for index, parent in enumerate(BONE_PARENTS):
        if parent >= 0:
            inverse = rotation.conjugate(orientations[parent])
            local_positions[index] = rotation.rotate(inverse, positions[index] - positions[parent])
            local_rotations[index] = rotation.multiply(inverse, orientations[index])
    return local_positions, local_rotations


_EXTENDED_KINDS = {
    "Neck": JointKind.NECK,
    "LeftShoulder": JointKind.LEFT_CLAVICLE,
    "RightShoulder": JointKind.RIGHT_CLAVICLE,
}
"""Joint of an extension that each bone follows; other bones of the trunk follow the spine."""
