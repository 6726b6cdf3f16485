"""Fingers of a performer, beside the figure's channels (proto/codec.md, 2.18).

A hand has a thumb and four fingers of up to three joints each. With all joints at rest, in the I-pose, the fingers hang
straight below the wrist and the thumb points down and forwards, whatever the rest pose of the source was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX

SIDES = ("l", "r")
WRISTS: tuple[int, int] = (JOINT_INDEX["l_wrist"], JOINT_INDEX["r_wrist"])
FINGERS = ("thumb", "index", "middle", "ring", "little")
CHAIN_COUNT = len(SIDES) * len(FINGERS)
"""Chains of joints: the fingers of the left hand, thumb first, then those of the right."""
MAX_CHAIN_JOINTS = 3
_THUMB_NAMES = ("carpometacarpal_1", "metacarpophalangeal_1", "carpal_interphalangeal_1")
_FINGER_NAMES = ("metacarpophalangeal", "carpal_proximal_interphalangeal", "carpal_distal_interphalangeal")
_VRM_THUMB_SEGMENTS = ("Metacarpal", "Proximal", "Distal")
_VRM_FINGER_SEGMENTS = ("Proximal", "Intermediate", "Distal")

HANIM_NAMES: tuple[tuple[str, ...], ...] = tuple(
    tuple(f"{side}_{name}" for name in (_THUMB_NAMES if digit == 1 else [f"{name}_{digit}" for name in _FINGER_NAMES]))
    for side in SIDES
    for digit in range(1, len(FINGERS) + 1)
)
"""Names of the joints of each chain by H-Anim 2, LOA-4 (ISO/IEC 19774-1), from the wrist outwards."""
VRM_NAMES: tuple[tuple[str, ...], ...] = tuple(
    tuple(
        f"{side}{finger.title()}{segment}"
        for segment in (_VRM_THUMB_SEGMENTS if finger == "thumb" else _VRM_FINGER_SEGMENTS)
    )
    for side in ("left", "right")
    for finger in FINGERS
)
"""Names of the joints of each chain by VRM 1.0."""
CHAIN_DIRECTIONS: Array = np.tile(
    np.concatenate([[[0.0, -np.sqrt(0.5), np.sqrt(0.5)]], np.tile([0.0, -1.0, 0.0], (4, 1))]), (2, 1)
)
"""Direction (10, 3) of each chain at rest, in the frame of its wrist."""


@dataclass(frozen=True, slots=True)
class Hands:
    """Joints of a performer's fingers, E in all, in the order of their chains, each from the wrist outwards.

    `counts` are the joints of each of the ten chains, 0..3. `bases` (10, 3) are the positions of the first joints from
    the wrist, and `lengths` (10, 3) those of the bones after each joint, in metres; zero where a joint is missing.
    """

    counts: tuple[int, ...]
    bases: Array
    lengths: Array

    @property
    def joints(self) -> list[tuple[int, int]]:
        """Chain of each joint and its place in the chain."""
        return [(chain, place) for chain, count in enumerate(self.counts) for place in range(count)]

    @property
    def names(self) -> tuple[str, ...]:
        """H-Anim name of each joint."""
        return tuple(HANIM_NAMES[chain][place] for chain, place in self.joints)


class HandsPose(NamedTuple):
    """World positions (n, E, 3) and orientations (n, E, 4) of the joints, and positions (n, 10, 3) of the tips.

    The tip of a chain without joints is at the wrist.
    """

    positions: Array
    orientations: Array
    tips: Array


def pose_hands(hands: Hands, wrist_positions: Array, wrist_orientations: Array, values: Array) -> HandsPose:
    """Return the pose of the fingers at n instants.

    Args:
        hands: Joints of the fingers.
        wrist_positions: World positions (n, 2, 3) of the left and the right wrist, metres.
        wrist_orientations: Their orientations (n, 2, 4).
        values: Rotation vectors (n, E, 3) of the joints in the frames of those before them, radians.
    """
    n = len(values)
    pose = HandsPose(np.empty((n, len(hands.joints), 3)), np.empty((n, len(hands.joints), 4)), np.empty((n, 10, 3)))
    joint = 0
    for chain, count in enumerate(hands.counts):
        side = chain // len(FINGERS)
        start, frame = wrist_positions[:, side], wrist_orientations[:, side]
        offset = hands.bases[chain]
        for place in range(count):
            start = start + rotation.rotate(frame, offset)
            frame = rotation.multiply(frame, rotation.from_rotation_vector(values[:, joint]))
            pose.positions[:, joint], pose.orientations[:, joint] = start, frame
            offset = hands.lengths[chain, place] * CHAIN_DIRECTIONS[chain]
            joint += 1
        pose.tips[:, chain] = start + rotation.rotate(frame, offset) if count else start
    return pose
