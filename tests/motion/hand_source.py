"""Sources for tests whose fingers bend and spread, in Mixamo's names and metres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.hands import FINGERS, Hands
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SampledMotion, chain_transforms
from tests.motion.extended_source import extended_source

MIXAMO_FINGERS = {"thumb": "Thumb", "index": "Index", "middle": "Middle", "ring": "Ring", "little": "Pinky"}
BASES_M = {
    "thumb": (0.028, -0.01, 0.026),
    "index": (0.09, 0.0, 0.025),
    "middle": (0.092, 0.0, 0.003),
    "ring": (0.088, 0.0, -0.018),
    "little": (0.08, 0.0, -0.036),
}
"""First joints of the left hand from its wrist, in a T-pose with the palm down."""
BONES_M = {
    "thumb": (0.038, 0.032, 0.026),
    "index": (0.042, 0.025, 0.022),
    "middle": (0.046, 0.029, 0.024),
    "ring": (0.042, 0.028, 0.023),
    "little": (0.033, 0.02, 0.019),
}
METACARPAL_SHARE = 0.3
"""Place of a metacarpal bone's joint between wrist and knuckle."""
THUMB_DIRECTION = (0.6, -0.2, 0.775)
REST_ARM_DEGREES = {"T": 0.0, "A": 45.0, "I": 90.0}


def hand_source(
    frames: int = 120,
    seed: int = 0,
    *,
    rest: str = "T",
    bend: float = 0.0,
    fan: float = 0.0,
    moves: bool = True,
    fingers: tuple[str, ...] = FINGERS,
    has_metacarpals: bool = False,
    has_tips: bool = True,
    has_plain_axes: bool = True,
) -> SampledMotion:
    """Return a smooth dance whose fingers bend by up to 1.4 and spread by up to 0.2 radians.

    Args:
        frames: Number of frames, 30 per second.
        seed: Seed of the movement.
        rest: Rest pose of the arms: "T", "A" or "I".
        bend: Rotation of each finger joint at rest, in radians.
        fan: Spread of the fingers at rest, from one to the next, in radians.
        moves: Whether the fingers leave the rest pose.
        fingers: Fingers that the source has.
        has_metacarpals: Whether a joint in the palm is above each finger but the thumb.
        has_tips: Whether a joint marks the tip of each finger.
        has_plain_axes: Whether all axes are those of the world at rest, as in a BVH file.
    """
    body = extended_source(frames, seed)
    names, parents = list(body.names), list(body.parents)
    offsets = [*(body.rest_positions - body.rest_positions[parents])]
    offsets[0] = np.zeros(3)
    local = rotation.multiply(rotation.conjugate(body.orientations[:, parents]), body.orientations)
    local[:, 0] = body.orientations[:, 0]
    turns = [local[:, joint] for joint in range(len(names))]
    still = [rotation.IDENTITY] * len(names)
    random = np.random.default_rng(seed + 1)
    t = np.arange(frames) / body.fps

    def add(name: str, parent: int, offset: Array, at_rest: Array, turn: Array | None) -> int:
        names.append(name)
        parents.append(parent)
        offsets.append(offset)
        still.append(at_rest)
        moved = np.tile(at_rest, (frames, 1)) if turn is None or not moves else turn
        turns.append(moved)
        return len(names) - 1

    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        mirror = np.array([sign, 1.0, 1.0])
        lowered = rotation.from_coordinate_axis(2, np.radians(-sign * REST_ARM_DEGREES[rest]))
        still[names.index(f"{side}Arm")] = lowered
        for finger in fingers:
            place = FINGERS.index(finger)
            base = mirror * BASES_M[finger]
            along = mirror * (THUMB_DIRECTION if finger == "thumb" else (1.0, 0.0, 0.0))
            along = along / np.linalg.norm(along)
            parent = names.index(f"{side}Hand")
            if has_metacarpals and finger != "thumb":
                name = f"{side}InHand{MIXAMO_FINGERS[finger]}"
                parent = add(name, parent, METACARPAL_SHARE * base, rotation.IDENTITY, None)
                base = (1.0 - METACARPAL_SHARE) * base
            for number in range(len(BONES_M[finger]) + has_tips):
                is_tip = number == len(BONES_M[finger])
                spread = fan * (place - 2) * sign if number == 0 and finger != "thumb" else 0.0
                at_rest = rotation.from_rotation_vector(np.array([0.0, spread, 0.0 if is_tip else -sign * bend]))
                flex = random.uniform(0.1, 0.7) + random.uniform(0.2, 0.7) * np.sin(
                    2.0 * np.pi * random.uniform(0.4, 1.2) * t + random.uniform(0.0, 6.0)
                )
                wave = 0.2 * np.sin(2.0 * np.pi * random.uniform(0.3, 0.9) * t) * (number == 0)
                turn = rotation.from_rotation_vector(np.stack([0.3 * wave, wave, -sign * flex], axis=-1))
                name = f"{side}Hand{MIXAMO_FINGERS[finger]}{number + 1}"
                parent = add(name, parent, base, at_rest, None if is_tip else turn)
                base = along * BONES_M[finger][number] if not is_tip else base
    placed = np.tile(np.array(offsets), (frames, 1, 1))
    placed[:, 0] = body.positions[:, 0]
    positions, orientations = chain_transforms(parents, placed, np.stack(turns, axis=1))
    rest_positions, rest_orientations = chain_transforms(parents, np.array(offsets), np.array(still))
    source = SampledMotion(
        tuple(names), tuple(parents), body.ends, body.fps, rest_positions, rest_orientations, positions, orientations
    )
    return with_plain_axes(source) if has_plain_axes else source


def with_plain_axes(source: SampledMotion) -> SampledMotion:
    """Return a source whose joints have the world's axes at rest, without ends."""
    orientations = rotation.multiply(source.orientations, rotation.conjugate(source.rest_orientations))
    rest = np.tile(rotation.IDENTITY, (len(source.names), 1))
    return replace(source, ends=(), orientations=orientations, rest_orientations=rest)


def standard_hands() -> Hands:
    """Return the hands of `hand_source`, as they are fitted to it."""
    bases, lengths = np.zeros((10, 3)), np.zeros((10, 3))
    for chain in range(10):
        finger = FINGERS[chain % 5]
        x, y, z = BASES_M[finger]
        # from palm down, arm to the side, to palm inwards, arm down
        bases[chain] = (y if chain < 5 else -y, -x, z)
        lengths[chain] = BONES_M[finger]
    return Hands((3,) * 10, bases, lengths)
