"""What a channel's values are multiplied with before they are quantised, from the dancer alone (SPEC.md, Weights): how
far a small turn moves what hangs on the joint, on axes that mean the same on every skeleton.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINT_COUNT, JOINT_INDEX, PARENTS, TIP_JOINTS, Figure

_LEVER_EXPONENT = 0.45
_TWIST_INERTIA_M2 = 0.06**2
# how much finer than its lever says a channel is coded: root position and rotation, sacroiliac, wrists, head, toes
_CHANNEL_PRECISION = np.ones(CHANNEL_COUNT)
_CHANNEL_PRECISION[[0, 1, 2]] = 1.15, 0.88, 0.88
_CHANNEL_PRECISION[[JOINT_INDEX[name] + 1 for name in ("l_midtarsal", "r_midtarsal")]] = 0.87
_CHANNEL_PRECISION[[JOINT_INDEX[name] + 1 for name in ("skullbase", "l_wrist", "r_wrist")]] = 0.9

_UPWARD_JOINTS = [JOINT_INDEX[name] for name in ("sacroiliac", "vl5", "skullbase")]
_HINGE_JOINTS = [
    JOINT_INDEX[side + name] for side in ("l_", "r_") for name in ("knee", "ankle", "midtarsal", "elbow", "wrist")
]
_MIN_BONE_LENGTH_M = 0.00095
"""Metres below which a bone has no direction; not on any figure's grid."""


def channel_weights(figure: Figure, reference: Array) -> Array:
    """The matrices (19, 3, 3) of a figure whose rotations are told from `reference`, quaternions (18, 4)."""
    points = np.ones(JOINT_COUNT)
    points[list(TIP_JOINTS)] += 1
    squares = np.zeros((JOINT_COUNT, 3, 3))

    def add(joint: int, arm: Array, count: float) -> None:
        squares[joint] += count**_LEVER_EXPONENT * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    for joint in range(JOINT_COUNT - 1, -1, -1):
        squares[joint] += _TWIST_INERTIA_M2 * np.eye(3)
        if joint in TIP_JOINTS:
            add(joint, figure.tips[joint], 1)
        if joint > 0:
            add(PARENTS[joint], figure.offsets[joint], points[joint])
            points[PARENTS[joint]] += points[joint]
    found = np.empty((CHANNEL_COUNT, 3, 3))
    found[0] = points[0] ** (_LEVER_EXPONENT / 2) * np.eye(3)
    values, vectors = np.linalg.eigh(squares)
    symmetric = (vectors * np.sqrt(values)[:, None]) @ vectors.transpose(0, 2, 1)
    found[1:] = _coding_axes(figure, reference) @ symmetric
    weighted: Array = found * _CHANNEL_PRECISION[:, None, None]
    return weighted


def _coding_axes(figure: Figure, reference: Array) -> Array:
    """Matrices (18, 3, 3) from a joint's own frame to the axes that it is coded on: of a joint with one bone its hinge,
    the bone, and what is across both; of the others the dancer's left, up and forward as the references have it."""
    standing = reference.copy()
    for joint in range(1, JOINT_COUNT):
        standing[joint] = rotation.multiply(standing[PARENTS[joint]], reference[joint])
    upright = rotation.to_matrix(standing)
    onto = upright.copy()
    for joint in range(JOINT_COUNT):
        arms = [figure.offsets[child] for child in range(JOINT_COUNT) if PARENTS[child] == joint]
        arms += [figure.tips[joint]] if joint in TIP_JOINTS else []
        bone = _unit_direction(upright[joint] @ arms[0]) if len(arms) == 1 else None
        if bone is None:
            continue
        before = _unit_direction(upright[PARENTS[joint]] @ figure.offsets[joint]) if joint in _HINGE_JOINTS else None
        onto[joint] = _bone_axes(bone, joint in _UPWARD_JOINTS, before).T @ upright[joint]
    return onto


def _unit_direction(arm: Array) -> Array | None:
    length = np.sqrt(arm @ arm)
    return arm / length if length > _MIN_BONE_LENGTH_M else None


def _bone_axes(bone: Array, is_upward: bool, parent_bone: Array | None) -> Array:
    """Axes (columns) with the second along a bone: those of a bone that hangs (stands, if `upward`) carried along the
    shortest way, turned about the bone to the hinge between it and the bone `before` where they are bent."""
    hanging = np.array([0.0, 1.0 if is_upward else -1.0, 0.0])
    if hanging @ bone > -0.8:
        axes = rotation.to_matrix(rotation.rotation_between(hanging, bone))
    else:
        # almost opposite: there is no one shortest way
        axes = rotation.to_matrix(rotation.rotation_between(-hanging, bone)) * [1.0, -1.0, -1.0]
    hinge = np.cross(parent_bone, bone) if parent_bone is not None else np.zeros(3)
    sine = np.sqrt(hinge @ hinge)
    if sine > 0.2:
        side = -1.0 if hinge @ axes[:, 0] < -1e-6 else 1.0
        first = hinge * (side / sine)
        axes = np.stack([first, axes[:, 1], np.cross(first, axes[:, 1])], axis=1)
    return axes
