"""Virtual Motion Capture protocol, performer to marionette (protocol.vmc.info): OSC messages with an avatar's pose.

Each frame has the root's transform, the local transforms of the bones, and at last the state and the time, with which
some receivers apply the frame. Positions are metres and rotations x y z w, both in Unity's left-handed frame and, for
bones, relative to the parent in the T-pose of a humanoid whose bones have the orientation of the world at rest.

The figure has no face: no blend shapes are sent, so the face stays with the receiver's own tracking.
"""

from __future__ import annotations

import numpy as np
from pythonosc.osc_message import OscMessage

from bunraku.motion.extension import BodyExtension, ExtendedPose
from bunraku.motion.humanoid import (
    BONES,
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


def make_frame(
    figure: Figure,
    root: Array,
    rotations: Array,
    seconds: float,
    *,
    extended: tuple[BodyExtension, ExtendedPose] | None = None,
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
    messages.append(make_message("/VMC/Ext/OK", MODEL_LOADED))
    messages.append(make_message("/VMC/Ext/T", float(seconds)))
    return messages


def _make_transform(address: str, name: str, position: Array, turn: Array) -> OscMessage:
    return make_message(address, name, *np.concatenate([position, turn]).tolist())
