"""Fit of the figure's arms and legs: rest directions, and rotations that follow the source's joints."""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.fit import FigureFit
from bunraku.motion.joint_rule import Aim, JointRule
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure

HAND_LENGTH_M, TOE_LENGTH_M = 0.18, 0.07
"""Default tips beyond wrist and midtarsal, where the codec's error is measured."""
HAND_LENGTH_RANGE_M = (0.10, 0.26)
FOOT_LENGTH_RANGE_M = (0.08, 0.35)
"""Ranges within which the source's own hand and foot lengths are used."""
INSTEP_RATIO = 0.65
"""Share of a foot before the ball, for a source whose foot is one bone."""

DOWN: Array = np.array([0.0, -1.0, 0.0])
FORWARD: Array = np.array([0.0, 0.0, 1.0])
MIN_LATERAL_COMPONENT = 0.35
"""Bones whose component in the frontal plane is smaller than this point forwards or backwards."""


def rotation_to_hanging(bone: Array) -> Array:
    """Return the rotation (4,) that brings a limb's bone (3,), in the figure's axes, to hang straight down.

    First about z, as an arm is lowered from a T- or A-pose: a palm that faced the floor then faces the thigh. The rest,
    forwards or backwards, is about x. A bone that points forwards at rest rotates about x only.
    """
    x, y, z = rotation.normalise(bone).tolist()
    across = float(np.hypot(x, y))
    if across < MIN_LATERAL_COMPONENT:
        return rotation.rotation_between(bone, DOWN)
    lowered = rotation.from_coordinate_axis(2, np.arctan2(-x, -y))
    return rotation.multiply(rotation.from_coordinate_axis(0, np.arctan2(z, across)), lowered)


def fit_leg(fit: FigureFit, side: str) -> None:
    """Place hip, knee, ankle and midtarsal of `side` ("l" or "r") and the toe tip; the hip's offset is known."""
    hip, knee, ankle, midtarsal = (JOINT_INDEX[f"{side}_{name}"] for name in ("hip", "knee", "ankle", "midtarsal"))
    _fit_long_bones(fit, hip, knee)
    fit.offsets[midtarsal], turn, toes = _fit_foot(fit, ankle, midtarsal)
    if ankle in fit.joints:
        _fit_joint(fit, ankle, turn)
    else:
        fit.place_joint(ankle, fit.offsets[ankle], JointRule(copied=knee))
    if midtarsal in fit.joints:
        _fit_joint(fit, midtarsal, turn)
    else:
        fit.place_joint(midtarsal, fit.offsets[midtarsal], JointRule(copied=ankle))
    fit.tips[midtarsal] = TOE_LENGTH_M * toes


def fit_arm(fit: FigureFit, side: str) -> None:
    """Place shoulder, elbow and wrist of `side` ("l" or "r") and the finger tip; the shoulder's offset is known."""
    shoulder, elbow, wrist = (JOINT_INDEX[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist"))
    turn = _fit_long_bones(fit, shoulder, elbow)
    length = HAND_LENGTH_M
    if wrist in fit.joints:
        hand = fit.farthest_descendant(fit.joints[wrist])
        if hand is not None and HAND_LENGTH_RANGE_M[0] <= np.linalg.norm(hand) <= HAND_LENGTH_RANGE_M[1]:
            length, turn = float(np.linalg.norm(hand)), rotation_to_hanging(hand)
        _fit_joint(fit, wrist, turn)
    else:
        fit.place_joint(wrist, fit.offsets[wrist], JointRule(copied=elbow))
    fit.tips[wrist] = length * DOWN


def _fit_long_bones(fit: FigureFit, upper: int, lower: int) -> Array:
    """Place a limb's two long bones, one straight below the other at rest; return the rest rotation (4,) of the lower.

    If the source's limb ends at `lower`, the lower bone gets the length and direction of the upper.
    """
    bone, length = fit.measure_bone(upper)
    turn = rotation_to_hanging(bone)
    fit.offsets[lower] = length * DOWN
    _fit_joint(fit, upper, turn)
    if lower + 1 in fit.joints:
        bone, length = fit.measure_bone(lower)
        turn = rotation_to_hanging(bone)
    fit.offsets[lower + 1] = length * DOWN
    _fit_joint(fit, lower, turn)
    return turn


def _fit_joint(fit: FigureFit, joint: int, turn: Array) -> None:
    """Place `joint` with the source's rotation, aimed so that the next joint coincides with the source's.

    `turn` (4,) rotates the source's rest pose to the figure's. The offsets of both joints are known.
    """
    following = None if joint in LIMB_END_JOINTS else fit.joints.get(joint + 1)
    aim = None if following is None else Aim(fit.offsets[joint + 1].copy(), following)
    fit.place_joint(
        joint, fit.offsets[joint], JointRule(source=fit.joints[joint], rest=rotation.conjugate(turn), aim=aim)
    )


LIMB_END_JOINTS = tuple(JOINT_INDEX[f"{side}_{name}"] for side in "lr" for name in ("midtarsal", "wrist"))


def _fit_foot(fit: FigureFit, ankle: int, midtarsal: int) -> tuple[Array, Array, Array]:
    """Return the midtarsal's offset (3,), the rotation (4,) from the source's rest to it, and the toes' direction (3,).

    A foot that stands flat in the source keeps its direction; any other is rotated to the front.
    """
    standard = standard_figure().offsets[midtarsal] * np.array([0.0, 1.0, 1.0])
    if midtarsal in fit.joints and ankle in fit.joints:
        bone, length = fit.measure_bone(ankle)
        if not _points_forward(bone):
            foot = rotation.normalise(standard) * length
            return foot, rotation.rotation_between(bone, foot), FORWARD
        end = fit.farthest_descendant(fit.joints[midtarsal])
        toes = rotation.normalise(end) if end is not None and _points_forward(end) else FORWARD
        return rotation.normalise(bone) * length, rotation.IDENTITY, toes
    end = fit.farthest_descendant(fit.joints[ankle]) if ankle in fit.joints else None
    if (
        end is not None
        and _points_forward(end)
        and FOOT_LENGTH_RANGE_M[0] <= np.linalg.norm(end) <= FOOT_LENGTH_RANGE_M[1]
    ):
        return INSTEP_RATIO * end, rotation.IDENTITY, FORWARD
    return standard, rotation.IDENTITY, FORWARD


def _points_forward(foot: Array) -> bool:
    """Return whether a bone of the foot (3,), in the figure's axes, points forwards and not upwards."""
    x, y, z = rotation.normalise(foot).tolist()
    return bool(z > 0.5 and abs(x) < 0.6 and y < 0.3)
