"""The figure's arms and legs: how they lie at rest, and how they follow the source's joints."""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.fit import FigureFit
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure

HAND_LENGTH_M, TOE_LENGTH_M = 0.18, 0.07
"""Metres beyond wrist and midtarsal: where error is measured."""
HAND_LENGTH_RANGE_M = (0.10, 0.26)
FOOT_LENGTH_RANGE_M = (0.08, 0.35)
"""A source's own hand and foot are believed within these, metres."""
INSTEP_RATIO = 0.65
"""Part of a foot that lies before the ball, for a source whose foot is one bone."""

DOWN: Array = np.array([0.0, -1.0, 0.0])
FORWARD: Array = np.array([0.0, 0.0, 1.0])
MIN_LATERAL_COMPONENT = 0.35
"""A bone whose part across and up is smaller than this points forwards or back."""


def rotation_to_hanging(bone: Array) -> Array:
    """The turn (4,) that brings a limb's bone (3,), in the figure's axes, to hang straight down.

    First about z, as an arm is lowered from a T- or A-pose: a palm that faced the floor then faces the thigh. What is
    left, forwards or back, goes about x. A bone that points forwards at rest goes about x alone.
    """
    x, y, z = rotation.normalise(bone).tolist()
    across = float(np.hypot(x, y))
    if across < MIN_LATERAL_COMPONENT:
        return rotation.rotation_between(bone, DOWN)
    lowered = rotation.from_coordinate_axis(2, np.arctan2(-x, -y))
    return rotation.multiply(rotation.from_coordinate_axis(0, np.arctan2(z, across)), lowered)


def aim_at(orientation: Array, offset: Array, start: Array, target: Array) -> Array:
    """`orientation` (n, 4) with the least turn that points `offset` (3,) from `start` (n, 3) at `target` (n, 3)."""
    there = target - start
    turn = rotation.rotation_between(rotation.rotate(orientation, offset), there)
    # a target at the joint itself gives no direction
    near = np.linalg.norm(there, axis=-1, keepdims=True) < 1e-6
    return rotation.normalise(rotation.multiply(np.where(near, rotation.IDENTITY, turn), orientation))


def fit_leg(fit: FigureFit, side: str) -> None:
    """Place hip, knee, ankle and midtarsal of `side` ("l" or "r") and the toes' tip; the hip's offset is known."""
    hip, knee, ankle, midtarsal = (JOINT_INDEX[f"{side}_{name}"] for name in ("hip", "knee", "ankle", "midtarsal"))
    _fit_long_bones(fit, hip, knee)
    fit.offsets[midtarsal], turn, toes = _fit_foot(fit, ankle, midtarsal)
    if ankle in fit.joints:
        _fit_joint(fit, ankle, turn)
    else:
        fit.place_joint(ankle, fit.offsets[ankle], fit.joint_orientations[:, knee])
    if midtarsal in fit.joints:
        _fit_joint(fit, midtarsal, turn)
    else:
        fit.place_joint(midtarsal, fit.offsets[midtarsal], fit.joint_orientations[:, ankle])
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
        fit.place_joint(wrist, fit.offsets[wrist], fit.joint_orientations[:, elbow])
    fit.tips[wrist] = length * DOWN


def _fit_long_bones(fit: FigureFit, upper: int, lower: int) -> Array:
    """Place a limb's two long bones, straight below one another at rest; the turn (4,) of the lower from the source.

    Where the source's limb ends at `lower`, its bone is as long as the upper and goes on straight.
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
    """Place `joint`, turned as the source's, and aimed so that the next joint is where the source has it.

    `turn` (4,) brings the source's rest to the figure's. The offsets of both joints are known.
    """
    orientation = rotation.multiply(fit.turn[:, fit.joints[joint]], rotation.conjugate(turn))
    fit.place_joint(joint, fit.offsets[joint], orientation)
    if joint not in LIMB_END_JOINTS and (following := fit.joints.get(joint + 1)) is not None:
        start, target = fit.joint_positions[:, joint], fit.position[:, following]
        fit.joint_orientations[:, joint] = aim_at(orientation, fit.offsets[joint + 1], start, target)


LIMB_END_JOINTS = tuple(JOINT_INDEX[f"{side}_{name}"] for side in "lr" for name in ("midtarsal", "wrist"))


def _fit_foot(fit: FigureFit, ankle: int, midtarsal: int) -> tuple[Array, Array, Array]:
    """The midtarsal's offset (3,), the turn (4,) from the source's rest to it, and the way of the toes (3,).

    A foot that stands flat in the source is kept as it is; one that points elsewhere is turned to the front.
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
    """Whether a bone of the foot (3,), in the figure's axes, points to the front and not up."""
    x, y, z = rotation.normalise(foot).tolist()
    return bool(z > 0.5 and abs(x) < 0.6 and y < 0.3)
