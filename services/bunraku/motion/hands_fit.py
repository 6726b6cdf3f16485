"""Fit of a performer's fingers to a source that has their joints (proto/codec.md, 2.18).

A joint's orientation is the source's rotation from its rest pose after a constant, by which the bone lies along the
chain of `hands.CHAIN_DIRECTIONS`. So fingers follow the source exactly, whatever its rest pose is: the values contain
how fingers are bent at rest.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.fit import FigureFit
from bunraku.motion.hands import CHAIN_COUNT, CHAIN_DIRECTIONS, FINGERS, MAX_CHAIN_JOINTS, WRISTS, Hands, pose_hands
from bunraku.motion.naming.finger_mapping import MAX_HAND_M, FingerChain
from bunraku.motion.procrustes import mean_local_positions
from bunraku.motion.rotation import Array

MIN_TURN_RAD = np.radians(1.0)
"""Fingers that never turn by this relative to the hand are not recorded."""
STILL_RAD = np.radians(0.05)
"""A joint that turns less than this relative to the one before may be only a tip."""
MAX_TURN_RAD = 4.0 * np.pi
"""Rotation vectors beyond this are not those of a finger."""
MAX_BONE_M, MIN_BONE_M = 0.2, 1e-3
"""Range of the bones of fingers; joints at one place have no direction."""
USUAL_RATIO = 0.8
"""Length of a last bone whose end the source does not have, as a share of the bone before, or of the palm."""
END_RATIO_RANGE = 0.25, 2.5
"""Range of that share in which an end in the source is used; others only mark that the chain ends."""


@dataclass(frozen=True, slots=True)
class HandsMotion:
    """Fingers of a motion: their joints, values (n, E, 3) in radians, and the source joint that each follows.

    `source_tips` are the source joints at the tips of the ten chains, None where the source has none.
    """

    hands: Hands
    values: Array
    sources: tuple[int, ...]
    source_tips: tuple[int | None, ...] = (None,) * CHAIN_COUNT


@dataclass(frozen=True, slots=True)
class _Chain:
    """Joints of one finger as they are fitted: base (3,), bones' lengths (m,), and values (n, m, 3)."""

    sources: tuple[int, ...]
    tip: int | None
    base: Array
    lengths: Array
    values: Array
    is_moving: bool


def fit_hands(fit: FigureFit) -> HandsMotion | None:
    """Return the fingers that follow the source's, whose wrists are fitted already.

    Returns None if the source has no joints of fingers, or none of them ever turns by `MIN_TURN_RAD`. Fingers with
    broken values or bones of an impossible length are left out.
    """
    chains: list[_Chain | None] = [
        _fit_chain(fit, number, chain) if chain.joints else None for number, chain in enumerate(fit.fingers)
    ]
    found = [chain for chain in chains if chain is not None]
    if not any(chain.is_moving for chain in found):
        return None
    bases, lengths = np.zeros((CHAIN_COUNT, 3)), np.zeros((CHAIN_COUNT, MAX_CHAIN_JOINTS))
    for number, chain in enumerate(chains):
        if chain is not None:
            bases[number], lengths[number, : len(chain.sources)] = chain.base, chain.lengths
    return HandsMotion(
        Hands(tuple(0 if chain is None else len(chain.sources) for chain in chains), bases, lengths),
        np.concatenate([chain.values for chain in found], axis=1),
        tuple(source for chain in found for source in chain.sources),
        tuple(None if chain is None else chain.tip for chain in chains),
    )


def measure_hands(fit: FigureFit, hands: HandsMotion, wrist_positions: Array) -> Array:
    """Return the distances (n, m) of the fingers' joints, and of tips that the source has, from its own, millimetres.

    `wrist_positions` (n, 2, 3) are those of the figure's wrists, which may differ from the source's.
    """
    pose = pose_hands(hands.hands, wrist_positions, fit.joint_orientations[:, list(WRISTS)], hands.values)
    tips = [(number, tip) for number, tip in enumerate(hands.source_tips) if tip is not None]
    placed = np.concatenate([pose.positions, pose.tips[:, [number for number, _ in tips]]], axis=1)
    sources = [*hands.sources, *(tip for _, tip in tips)]
    apart: Array = 1000.0 * np.linalg.norm(placed - fit.position[:, sources], axis=-1)
    return apart


def _fit_chain(fit: FigureFit, number: int, chain: FingerChain) -> _Chain | None:
    """Return one finger, None if its values or bones cannot be those of a finger."""
    wrist = WRISTS[number // len(FINGERS)]
    wrist_source, hand = fit.joints[wrist], fit.joint_orientations[:, wrist]
    joints, tip = _drop_still_tip(fit, chain)
    base = mean_local_positions(hand, fit.position[:, joints[:1]] - fit.position[:, [wrist_source]])[0]
    bones = [_measure_bone(fit, start, end) for start, end in itertools.pairwise(joints)]
    reach = np.linalg.norm(base)
    palm = fit.rest_positions[joints[0]] - fit.rest_positions[wrist_source]
    bones.append(_measure_last_bone(fit, joints[-1], tip, bones[-1] if bones else None, palm))
    lengths = np.linalg.norm(bones, axis=-1)
    if not (reach <= MAX_HAND_M and (lengths >= MIN_BONE_M).all() and (lengths <= MAX_BONE_M).all()):
        return None
    orientations = _orient_joints(fit, wrist, joints, bones, CHAIN_DIRECTIONS[number])
    frames = np.concatenate([hand[:, None], orientations[:, :-1]], axis=1)
    turns = rotation.normalise(rotation.multiply(rotation.conjugate(frames), orientations))
    values = rotation.unwrap_rotation_vectors(rotation.to_rotation_vector(turns))
    if not (np.abs(values) <= MAX_TURN_RAD).all():
        return None
    is_moving = any(float(_turn_between(fit, wrist_source, joint).max()) >= MIN_TURN_RAD for joint in joints)
    return _Chain(tuple(joints), tip, base, lengths, values, is_moving)


def _drop_still_tip(fit: FigureFit, chain: FingerChain) -> tuple[list[int], int | None]:
    """Return the joints of a chain and its tip: its last joint if that may be only a tip, and never turns."""
    joints = list(chain.joints)
    if not chain.may_be_tip or any(end.parent == joints[-1] for end in fit.source.ends):
        return joints, chain.tip
    if _turn_between(fit, joints[-2], joints[-1]).max() > STILL_RAD:
        return joints, chain.tip
    return joints[:-1], joints[-1]


def _turn_between(fit: FigureFit, first: int, second: int) -> Array:
    """Return by how much (n,) the source turns one joint relative to another from their rest, in radians."""
    turn = rotation.multiply(rotation.conjugate(fit.turn[:, first]), fit.turn[:, second])
    angle: Array = np.linalg.norm(rotation.to_rotation_vector(rotation.normalise(turn)), axis=-1)
    return angle


def _measure_bone(fit: FigureFit, start: int, end: int) -> Array:
    """Return the mean bone (3,) between two source joints as it lies at rest, in the figure's axes."""
    bone: Array = mean_local_positions(fit.turn[:, start], fit.position[:, [end]] - fit.position[:, [start]])[0]
    return bone


def _measure_last_bone(fit: FigureFit, joint: int, tip: int | None, before: Array | None, palm: Array) -> Array:
    """Return the bone (3,) after a finger's last joint as it lies at rest: the source's if it has one, or a usual one.

    `before` is the bone before it, None for a finger of one joint; `palm` the finger's base from the wrist at rest.
    """
    end = _measure_bone(fit, joint, tip) if tip is not None else _find_end(fit, joint)
    if end is not None and before is None and np.linalg.norm(end) >= MIN_BONE_M:
        return end
    if end is not None and before is not None and end @ before > 0.0:
        ratio = np.linalg.norm(end) / np.linalg.norm(before)
        if END_RATIO_RANGE[0] <= ratio <= END_RATIO_RANGE[1]:
            return end
    usual: Array = USUAL_RATIO * (palm if before is None else before)
    return usual


def _find_end(fit: FigureFit, joint: int) -> Array | None:
    """Return the end (3,) of a source joint's bone beyond all joints, as it lies at rest; None if there is none."""
    for end in fit.source.ends:
        if end.parent == joint:
            offset: Array = fit.scale * rotation.rotate(fit.rest_orientations[joint], end.offset)
            return offset
    return None


def _orient_joints(fit: FigureFit, wrist: int, joints: list[int], bones: list[Array], direction: Array) -> Array:
    """Return the world orientations (n, m, 4) of a finger's joints.

    At rest each is turned from the one before by the shortest rotation that brings the chain's direction to the bone.
    """
    frame = rotation.normalise(fit.rules[wrist].rest)
    oriented = []
    for joint, bone in zip(joints, bones, strict=True):
        frame = rotation.multiply(rotation.rotation_between(rotation.rotate(frame, direction), bone), frame)
        oriented.append(rotation.multiply(fit.turn[:, joint], frame))
    return np.stack(oriented, axis=1)
