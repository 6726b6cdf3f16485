"""Weights of the channels: how far a small rotation of each joint moves the body (proto/codec.md, 2.5 and 2.6).

A channel's values are multiplied with its weight before they are quantised. Weights depend on the skeleton description
alone, and their axes have the same meaning on every skeleton.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_COUNT, JOINT_INDEX, PARENTS, TIP_JOINTS, Figure

_LEVER_EXPONENT = 0.45
_TWIST_INERTIA_M2 = 0.06**2
# precision relative to what the lever arms give: root position and rotation, sacroiliac, toes, head, wrists
_CHANNEL_PRECISION = np.ones(CHANNEL_COUNT)
_CHANNEL_PRECISION[[0, 1, 2]] = 1.15, 0.88, 0.88
_CHANNEL_PRECISION[[JOINT_INDEX[name] + 1 for name in ("l_midtarsal", "r_midtarsal")]] = 0.87
_CHANNEL_PRECISION[[JOINT_INDEX[name] + 1 for name in ("skullbase", "l_wrist", "r_wrist")]] = 0.9

_UPWARD_JOINTS = [JOINT_INDEX[name] for name in ("sacroiliac", "vl5", "skullbase")]
_HINGE_JOINTS = [
    JOINT_INDEX[side + name] for side in ("l_", "r_") for name in ("knee", "ankle", "midtarsal", "elbow", "wrist")
]
_MIN_BONE_LENGTH_M = 0.00095
"""Length below which a bone has no direction; no bone on a grid has exactly this length."""
_MIN_SHORTEST_ARC_COSINE = -0.8
"""Cosine below which two directions are treated as opposite: the shortest rotation is then ambiguous."""
_MIN_HINGE_SINE = 0.2


def channel_weights(figure: Figure, reference: Array) -> Array:
    """Return the weight matrices (19, 3, 3) of a figure whose rotations are relative to `reference` (18, 4)."""
    points = np.ones(JOINT_COUNT)
    points[list(TIP_JOINTS)] += 1
    squares = np.zeros((JOINT_COUNT, 3, 3))

    def add_lever(joint: int, arm: Array, count: float) -> None:
        squares[joint] += count**_LEVER_EXPONENT * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    for joint in range(JOINT_COUNT - 1, -1, -1):
        squares[joint] += _TWIST_INERTIA_M2 * np.eye(3)
        if joint in TIP_JOINTS:
            add_lever(joint, figure.tips[joint], 1)
        if joint > 0:
            add_lever(PARENTS[joint], figure.offsets[joint], points[joint])
            points[PARENTS[joint]] += points[joint]
    weights = np.empty((CHANNEL_COUNT, 3, 3))
    weights[0] = points[0] ** (_LEVER_EXPONENT / 2) * np.eye(3)
    eigenvalues, eigenvectors = np.linalg.eigh(squares)
    square_roots = (eigenvectors * np.sqrt(eigenvalues)[:, None]) @ eigenvectors.transpose(0, 2, 1)
    weights[1:] = _coding_axes(figure, reference) @ square_roots
    weights *= _CHANNEL_PRECISION[:, None, None]
    return weights


def _coding_axes(figure: Figure, reference: Array) -> Array:
    """Return the matrices (18, 3, 3) from each joint's own frame to the axes in which it is coded.

    A joint with one bone has its hinge, the bone, and their normal as axes. Other joints have the left, up and forward
    direction of the figure in its reference pose.
    """
    world = reference.copy()
    for joint in range(1, JOINT_COUNT):
        world[joint] = rotation.multiply(world[PARENTS[joint]], reference[joint])
    orientation = rotation.to_matrix(world)
    axes = orientation.copy()
    for joint in range(JOINT_COUNT):
        arms = [figure.offsets[child] for child in range(JOINT_COUNT) if PARENTS[child] == joint]
        arms += [figure.tips[joint]] if joint in TIP_JOINTS else []
        bone = _unit_direction(orientation[joint] @ arms[0]) if len(arms) == 1 else None
        if bone is None:
            continue
        parent_bone = None
        if joint in _HINGE_JOINTS:
            parent_bone = _unit_direction(orientation[PARENTS[joint]] @ figure.offsets[joint])
        axes[joint] = _bone_axes(bone, joint in _UPWARD_JOINTS, parent_bone).T @ orientation[joint]
    return axes


def _unit_direction(arm: Array) -> Array | None:
    length = np.sqrt(arm @ arm)
    return arm / length if length > _MIN_BONE_LENGTH_M else None


def _bone_axes(bone: Array, is_upward: bool, parent_bone: Array | None) -> Array:
    """Return axes (columns) of which the second points along `bone`.

    They are the world axes of a bone that points straight down (`is_upward`: up), carried by the shortest rotation. If
    the bone and its parent form an angle, the axes turn about the bone until the first is the hinge between the two.
    """
    rest = np.array([0.0, 1.0 if is_upward else -1.0, 0.0])
    if rest @ bone > _MIN_SHORTEST_ARC_COSINE:
        axes = rotation.to_matrix(rotation.rotation_between(rest, bone))
    else:
        axes = rotation.to_matrix(rotation.rotation_between(-rest, bone)) * [1.0, -1.0, -1.0]
    hinge = np.cross(parent_bone, bone) if parent_bone is not None else np.zeros(3)
    sine = np.sqrt(hinge @ hinge)
    if sine > _MIN_HINGE_SINE:
        side = -1.0 if hinge @ axes[:, 0] < -1e-6 else 1.0
        first = hinge * (side / sine)
        axes = np.stack([first, axes[:, 1], np.cross(first, axes[:, 1])], axis=1)
    return axes
