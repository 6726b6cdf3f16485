"""Bones of Unity's humanoid, which VMC and Rokoko capture, and their lengths in the standard figure.

Source: Unity Scripting API, `HumanBodyBones`. An optional bone that a sender omits is replaced by the next one above.
"""

from __future__ import annotations

from bunraku.marionette.solver.vector import Vector
from bunraku.motion.skeleton import JOINT_INDEX, PARENTS, standard_figure

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
"""Joint of the figure for each bone that has one."""


def standard_offsets() -> dict[str, Vector]:
    """Return the position of each bone of `FIGURE_JOINTS` from its parent bone in the T-pose of the standard figure.

    Metres, in the figure's axes. A parent without a joint of its own counts as the next one above that has one.
    """
    figure = standard_figure()
    place: dict[str, tuple[float, float, float]] = {}
    positions = figure.offsets.copy()
    for joint in range(1, len(positions)):
        x, y, z = positions[joint].tolist()
        name = next((name for name, index in JOINT_INDEX.items() if index == joint), "")
        if name[2:] in ("elbow", "wrist"):
            # the hanging arm raised sideways
            x, y = (-y, x) if name[0] == "l" else (y, -x)
        positions[joint] = (x, y, z) + positions[PARENTS[joint]]
    for bone, joint_name in FIGURE_JOINTS.items():
        parent = PARENTS_BY_BONE[bone]
        while parent is not None and parent not in FIGURE_JOINTS:
            parent = PARENTS_BY_BONE[parent]
        above = positions[JOINT_INDEX[FIGURE_JOINTS[parent]]] if parent is not None else 0.0
        x, y, z = (positions[JOINT_INDEX[joint_name]] - above).tolist()
        place[bone] = (x, y, z)
    return place
