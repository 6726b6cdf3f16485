"""Bones of Unity's humanoid, which VMC and Rokoko capture, and their lengths in the standard figure.

Source: Unity Scripting API, `HumanBodyBones`. An optional bone that a sender omits is replaced by the next one above.
"""

from __future__ import annotations

from bunraku.marionette.solver.vector import Vector
from bunraku.motion.humanoid import BONE_PARENTS, BONES, bone_offsets, rest_hips_position
from bunraku.motion.skeleton import standard_figure

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


def standard_t_pose() -> dict[str, Vector]:
    """Return the positions of the body's bones in the T-pose of the standard figure, metres, in the figure's axes."""
    figure = standard_figure()
    positions = bone_offsets(figure)
    positions[0] = rest_hips_position(figure)
    for bone, parent in enumerate(BONE_PARENTS[1:], 1):
        positions[bone] += positions[parent]
    return {bone: (x, y, z) for bone, (x, y, z) in zip(BONES, positions.tolist(), strict=True)}
