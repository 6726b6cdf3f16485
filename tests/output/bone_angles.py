"""Difference between a received humanoid pose and the figure's, in degrees."""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array, to_matrix
from bunraku.motion.skeleton import JOINT_INDEX, TIP_JOINTS, Figure, joint_and_tip_positions, world_transforms
from tests.output.vmc_receiver import UnityPose

FIGURE_JOINTS = {
    "Hips": "sacroiliac",
    "Spine": "vl5",
    "Head": "skullbase",
    **{
        side + bone: f"{letter}_{joint}"
        for side, letter in (("Left", "l"), ("Right", "r"))
        for bone, joint in (
            ("UpperLeg", "hip"),
            ("LowerLeg", "knee"),
            ("Foot", "ankle"),
            ("Toes", "midtarsal"),
            ("UpperArm", "shoulder"),
            ("LowerArm", "elbow"),
            ("Hand", "wrist"),
        )
    },
}
BONE_ENDS = [
    (side + first, side + second)
    for side in ("Left", "Right")
    for first, second in (
        ("UpperLeg", "LowerLeg"),
        ("LowerLeg", "Foot"),
        ("Foot", "Toes"),
        ("UpperArm", "LowerArm"),
        ("LowerArm", "Hand"),
    )
] + [("Spine", "Head"), ("Spine", "LeftUpperArm"), ("Spine", "RightUpperArm"), ("Hips", "LeftUpperLeg")]
"""Pairs of bones whose positions have the same direction in the figure and in the humanoid."""
MIRROR = np.diag([-1.0, 1.0, 1.0])


def _angle(a: Array, b: Array) -> float:
    """Return the angle between two directions, accurately also where it is small."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))))


def max_bone_angle(received: UnityPose, figure: Figure, root: Array, rotations: Array) -> float:
    """Return the largest difference of a bone's direction or orientation in degrees.

    Directions are between the positions of joints. Orientations include the turn about a bone: the T-pose of a bone is
    the figure's rest pose but for the arms, which are turned up by 90 degrees.
    """
    places, turns = world_transforms(figure, root, rotations)
    angles = []
    for first, second in BONE_ENDS:
        expected = MIRROR @ (places[JOINT_INDEX[FIGURE_JOINTS[second]]] - places[JOINT_INDEX[FIGURE_JOINTS[first]]])
        angles.append(_angle(received.positions[second] - received.positions[first], expected))
    for bone, joint in FIGURE_JOINTS.items():
        # in the T-pose a left arm points along the figure's x, at rest along -y: x to -y, y to x
        arms = {"Left": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], "Right": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}
        side = bone[: -len(bone.removeprefix("Left").removeprefix("Right"))]
        is_arm = joint.endswith(("shoulder", "elbow", "wrist"))
        to_rest = np.array(arms[side]) if is_arm else np.eye(3)
        expected = MIRROR @ to_matrix(turns[JOINT_INDEX[joint]]) @ to_rest @ MIRROR
        turned = received.orientations[bone]
        angles += [_angle(turned[:, axis], expected[:, axis]) for axis in range(3)]
    return max(angles)


def tip_positions(figure: Figure, root: Array, rotations: Array) -> dict[str, Array]:
    """Return the world positions of the tips by joint."""
    points = joint_and_tip_positions(figure, root, rotations)
    names = list(JOINT_INDEX)
    return {names[joint]: points[len(names) + nth] for nth, joint in enumerate(TIP_JOINTS)}
