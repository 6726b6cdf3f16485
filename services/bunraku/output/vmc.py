"""Virtual Motion Capture protocol, performer to marionette (protocol.vmc.info): OSC messages with an avatar's pose.

Each frame has the root's transform, the local transforms of the bones, and at last the state and the time, with which
some receivers apply the frame. Positions are metres and rotations x y z w, both in Unity's left-handed frame and, for
bones, relative to the parent in the T-pose of a humanoid whose bones have the orientation of the world at rest.

A performer without a face sends no blend shapes, so the face stays with the receiver's own tracking. Expressions have
their names of ARKit and VRM 1.0; presets are sent with their names of VRM 0.x, too, by which older receivers know them.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from pythonosc.osc_message import OscMessage

from bunraku.motion import rotation
from bunraku.motion.extension import BodyExtension, ExtendedPose
from bunraku.motion.face import GAZE
from bunraku.motion.hands import CHAIN_DIRECTIONS, FINGERS, WRISTS, Hands
from bunraku.motion.humanoid import (
    BONES,
    T_POSE_TO_REST,
    bone_offsets,
    bone_rotations,
    extended_bones,
    hips_position,
    rest_hips_position,
)
from bunraku.motion.rotation import IDENTITY, Array
from bunraku.motion.skeleton import Figure
from bunraku.motion.unity_axes import mirror_rotations, mirror_vectors, to_xyzw
from bunraku.output.osc import make_message

DEFAULT_PORT = 39539
"""Port of a marionette by the protocol's convention; 39540 is that of a performer that also receives."""
MODEL_LOADED = 1
OLDER_PRESETS = {
    "aa": "A",
    "ih": "I",
    "ou": "U",
    "ee": "E",
    "oh": "O",
    "blink": "Blink",
    "blinkLeft": "Blink_L",
    "blinkRight": "Blink_R",
    "happy": "Joy",
    "angry": "Angry",
    "sad": "Sorrow",
    "relaxed": "Fun",
    "neutral": "Neutral",
    "lookUp": "LookUp",
    "lookDown": "LookDown",
    "lookLeft": "LookLeft",
    "lookRight": "LookRight",
}
"""Names of the presets in VRM 0.x, by those of VRM 1.0."""
FINGER_BONES: tuple[tuple[str, ...], ...] = tuple(
    tuple(f"{side}{finger.title()}{segment}" for segment in ("Proximal", "Intermediate", "Distal"))
    for side in ("Left", "Right")
    for finger in FINGERS
)
"""Names of the fingers' bones in Unity's HumanBodyBones, by chain of `motion.hands`."""


def make_frame(
    figure: Figure,
    root: Array,
    rotations: Array,
    seconds: float,
    *,
    extended: tuple[BodyExtension, ExtendedPose] | None = None,
    fingers: tuple[Hands, Array] | None = None,
    expressions: Mapping[str, float] = MappingProxyType({}),
    scale: float = 1.0,
    root_motion: bool = False,
) -> list[OscMessage]:
    """Return the messages of one frame.

    Args:
        figure: Limb lengths of the performer.
        root: Position (3,) of the root in metres, world frame.
        rotations: Rotations (18, 4) of the joints, as in `motion.skeleton.Motion`.
        seconds: Time of the frame since the first one.
        extended: Extension of the performer with its pose at this instant, which turns chest, neck and shoulders.
        fingers: Fingers of the performer with the rotation vectors (E, 3) of their joints at this instant.
        expressions: Weights of the performer's face; gaze in radians.
        scale: Factor of all positions: the height of the avatar's hips in proportion to the figure's.
        root_motion: Move the root instead of the hips, which then stay at their position in the T-pose. It is for
            receivers that ignore the positions of bones.
    """
    if extended is None:
        positions, local_rotations = bone_offsets(figure), bone_rotations(rotations)
    else:
        positions, local_rotations = extended_bones(*extended)
    hips = hips_position(figure, root, rotations)
    positions[0] = rest_hips_position(figure) if root_motion else hips
    moved = hips - positions[0]
    turns = to_xyzw(mirror_rotations(local_rotations))
    messages = [_make_transform("/VMC/Ext/Root/Pos", "root", scale * mirror_vectors(moved), to_xyzw(IDENTITY))]
    messages += [
        _make_transform("/VMC/Ext/Bone/Pos", bone, position, turn)
        for bone, position, turn in zip(BONES, scale * mirror_vectors(positions), turns, strict=True)
    ]
    if fingers is not None:
        messages += _make_fingers(*fingers, scale)
    messages += _make_face(expressions)
    messages.append(make_message("/VMC/Ext/OK", MODEL_LOADED))
    messages.append(make_message("/VMC/Ext/T", float(seconds)))
    return messages


def _make_fingers(hands: Hands, values: Array, scale: float) -> list[OscMessage]:
    """Return the messages of the fingers' bones, which in the T-pose lie along the raised arms."""
    messages = []
    for joint, (chain, place) in enumerate(hands.joints):
        to_rest = T_POSE_TO_REST[WRISTS[chain // len(FINGERS)]]
        to_t_pose = rotation.conjugate(to_rest)
        offset = hands.bases[chain] if place == 0 else hands.lengths[chain, place - 1] * CHAIN_DIRECTIONS[chain]
        turn = rotation.multiply(rotation.multiply(to_t_pose, rotation.from_rotation_vector(values[joint])), to_rest)
        position = scale * mirror_vectors(rotation.rotate(to_t_pose, offset))
        name = FINGER_BONES[chain][place]
        messages.append(_make_transform("/VMC/Ext/Bone/Pos", name, position, to_xyzw(mirror_rotations(turn))))
    return messages


def _make_face(expressions: Mapping[str, float]) -> list[OscMessage]:
    """Return the messages of a face's expressions, and of the point that the eyes look at; none without a face."""
    if not expressions:
        return []
    weights = {name: weight for name, weight in expressions.items() if name not in GAZE}
    weights |= {OLDER_PRESETS[name]: weight for name, weight in weights.items() if name in OLDER_PRESETS}
    messages = [make_message("/VMC/Ext/Blend/Val", name, float(weight)) for name, weight in weights.items()]
    messages.append(make_message("/VMC/Ext/Blend/Apply"))
    if any(name in expressions for name in GAZE):
        yaw, pitch = (expressions.get(name, 0.0) for name in GAZE)
        ahead = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
        messages.append(make_message("/VMC/Ext/Set/Eye", 1, *mirror_vectors(ahead).tolist()))
    return messages


def _make_transform(address: str, name: str, position: Array, turn: Array) -> OscMessage:
    return make_message(address, name, *np.concatenate([position, turn]).tolist())
