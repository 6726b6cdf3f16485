"""Bones of Unity's humanoid, which VMC and Rokoko capture, and their lengths in the standard figure.

Source: Unity Scripting API, `HumanBodyBones`. An optional bone that a sender omits is replaced by the next one above.
"""

from __future__ import annotations

from bunraku.marionette.solver.vector import Vector
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, JOINTS, PARENTS, standard_figure

ROOT_NAME = "Root"
"""Transform above the hips, which moves the whole avatar."""

BODY_PARENTS: dict[str, str] = {
    "Hips": ROOT_NAME,
    "Spine": "Hips",
    "Chest": "Spine",
    "UpperChest": "Chest",
    "Neck": "UpperChest",
    "Head": "Neck",
    "LeftEye": "Head",
    "RightEye": "Head",
    "Jaw": "Head",
}
_LIMBS = {
    "Shoulder": "UpperChest",
    "UpperArm": "Shoulder",
    "LowerArm": "UpperArm",
    "Hand": "LowerArm",
    "UpperLeg": "Hips",
    "LowerLeg": "UpperLeg",
    "Foot": "LowerLeg",
    "Toes": "Foot",
}
_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Little")


def _list_bones() -> dict[str, str | None]:
    parents: dict[str, str | None] = {ROOT_NAME: None, **BODY_PARENTS}
    for side in ("Left", "Right"):
        for bone, parent in _LIMBS.items():
            parents[side + bone] = parent if parent in BODY_PARENTS else side + parent
        for finger in _FINGERS:
            parents[f"{side}{finger}Proximal"] = f"{side}Hand"
            parents[f"{side}{finger}Intermediate"] = f"{side}{finger}Proximal"
            parents[f"{side}{finger}Distal"] = f"{side}{finger}Intermediate"
    return parents


PARENTS_BY_BONE: dict[str, str | None] = _list_bones()
"""Parent of each of the 55 bones and of the root, parents before children."""
BONE_BY_LOWER_NAME: dict[str, str] = {name.lower(): name for name in PARENTS_BY_BONE if name != ROOT_NAME}
"""Bones by their names in lower case, as some senders differ in case."""

FIGURE_JOINTS: dict[str, str] = {"Hips": "sacroiliac", "Spine": "vl5", "Head": "skullbase"} | {
    bone.format(side): joint.format(letter)
    for side, letter in (("Left", "l"), ("Right", "r"))
    for bone, joint in (
        ("{}UpperLeg", "{}_hip"),
        ("{}LowerLeg", "{}_knee"),
        ("{}Foot", "{}_ankle"),
        ("{}Toes", "{}_midtarsal"),
        ("{}UpperArm", "{}_shoulder"),
        ("{}LowerArm", "{}_elbow"),
        ("{}Hand", "{}_wrist"),
    )
}
"""Joints of the figure by bone."""


CHEST_SHARE = 0.4
"""Height of the chest, as a share of the way from the spine to the middle of the shoulders."""
CLAVICLE_SHARE = 0.25
"""Position of a shoulder bone, as a share of the way from the middle of the shoulders to the upper arm."""


def standard_t_pose() -> dict[str, Vector]:
    """Return the positions of the body's bones in the T-pose of the standard figure, metres, in the figure's axes."""
    figure = standard_figure()
    positions = figure.offsets.copy()
    for joint in range(1, JOINT_COUNT):
        x, y, z = positions[joint].tolist()
        if JOINTS[joint][2:] in ("elbow", "wrist"):
            # the hanging arm raised sideways
            x, y = (-y, x) if JOINTS[joint].startswith("l_") else (y, -x)
        positions[joint] = (x, y, z) + positions[PARENTS[joint]]
    bones = {bone: positions[JOINT_INDEX[joint]] for bone, joint in FIGURE_JOINTS.items()}
    middle = 0.5 * (bones["LeftUpperArm"] + bones["RightUpperArm"])
    bones["Chest"] = bones["UpperChest"] = bones["Spine"] + CHEST_SHARE * (middle - bones["Spine"])
    bones["Neck"] = middle
    for side in ("Left", "Right"):
        bones[f"{side}Shoulder"] = middle + CLAVICLE_SHARE * (bones[f"{side}UpperArm"] - middle)
    return {bone: (x, y, z) for bone, (x, y, z) in ((bone, place.tolist()) for bone, place in bones.items())}
