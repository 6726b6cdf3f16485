"""Performer of VMC: a recorded clip as the packets that a capture tool sends.

The clip's joints become bones of Unity's humanoid in the T-pose that the protocol defines. Packets are built with
python-osc, so that the reader is tested against another implementation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from bunraku.motion import rotation
from bunraku.motion.analysis import SourceFit, fit_source
from bunraku.motion.joint_tree import ancestor_chain, common_ancestor
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Motion
from bunraku.motion.source_motion import SourceMotion
from bunraku.motion.unity_axes import mirror_rotations, mirror_vectors, to_xyzw
from tests.motion.synthetic_motion import export_bvh, pose_with_arms

SIDES = (("Left", "l", 1.0), ("Right", "r", -1.0))
LIMB_BONES = {
    "UpperLeg": "hip",
    "LowerLeg": "knee",
    "Foot": "ankle",
    "Toes": "midtarsal",
    "UpperArm": "shoulder",
    "LowerArm": "elbow",
    "Hand": "wrist",
}


@dataclass(frozen=True, slots=True)
class Performance:
    """Local transforms of `bones` in n frames: positions (n, B, 3) in metres, rotations (n, B, 4), Unity's axes.

    Quaternions are w x y z. The hips' transform is in the world.
    """

    bones: tuple[str, ...]
    fps: float
    positions: Array
    rotations: Array

    @property
    def frame_count(self) -> int:
        return len(self.positions)


def perform(bvh: Bvh) -> Performance:
    """Return the performance of a clip, with all bones for which it has joints."""
    source = fit_source(bvh)
    joints = assign_bones(source)
    bones = tuple(joints)
    fit = source.fit
    sources = list(joints.values())
    to_rest = np.stack([_t_pose_to_rest(source, bone, joints) for bone in bones])
    world = rotation.multiply(fit.turn[:, sources], to_rest)
    parents = [_parent_index(fit.source, sources, index) for index in range(len(bones))]
    positions, rotations = fit.position[:, sources].copy(), world.copy()
    for index, parent in enumerate(parents):
        if parent >= 0:
            back = rotation.conjugate(world[:, parent])
            apart = fit.position[:, sources[index]] - fit.position[:, sources[parent]]
            positions[:, index] = rotation.rotate(back, apart)
            rotations[:, index] = rotation.multiply(back, world[:, index])
    return Performance(bones, bvh.fps, mirror_vectors(positions), mirror_rotations(rotations))


def perform_motion(motion: Motion) -> Performance:
    """Return the performance of a synthetic motion, whose pelvis then follows the root."""
    motion.rotations[:, JOINT_INDEX["sacroiliac"]] = rotation.IDENTITY
    return perform(parse_bvh(export_bvh(motion, pose_with_arms(90.0))))


def assign_bones(source: SourceFit) -> dict[str, int]:
    """Return the source joint of each bone, parents before children."""
    fit, bvh = source.fit, source.fit.source
    root = fit.joints[0]
    shoulders = [fit.joints[JOINT_INDEX[name]] for name in ("l_shoulder", "r_shoulder")]
    chest = common_ancestor(bvh.parents, shoulders)
    spine = _path(bvh, root, chest)[1:]
    bones = {"Hips": root}
    if len(spine) >= 3:
        bones |= {"Spine": spine[0], "Chest": spine[len(spine) // 2], "UpperChest": spine[-1]}
    else:
        bones |= dict(zip(("Spine", "Chest"), spine, strict=False))
    head = fit.joints.get(JOINT_INDEX["skullbase"])
    if head is not None:
        neck = _path(bvh, chest, head)[1:]
        bones |= {"Neck": neck[0], "Head": head} if len(neck) > 1 else {"Head": head}
    for side, letter, _ in SIDES:
        collar = _path(bvh, chest, fit.joints[JOINT_INDEX[f"{letter}_shoulder"]])[1:-1]
        if collar:
            bones[f"{side}Shoulder"] = collar[-1]
        for bone, joint in LIMB_BONES.items():
            if (found := fit.joints.get(JOINT_INDEX[f"{letter}_{joint}"])) is not None:
                bones[side + bone] = found
    return bones


def make_messages(performance: Performance, frame: int, seconds: float) -> list[OscMessage]:
    """Return the messages of a frame in the order of many senders: root, bones, weights, state, time."""
    turns = to_xyzw(performance.rotations[frame])
    messages = [make_message("/VMC/Ext/Root/Pos", "root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)]
    for bone, position, turn in zip(performance.bones, performance.positions[frame], turns, strict=True):
        messages.append(make_message("/VMC/Ext/Bone/Pos", bone, *position.tolist(), *turn.tolist()))
    messages.append(make_message("/VMC/Ext/Blend/Val", "Joy", 0.5))
    messages.append(make_message("/VMC/Ext/Blend/Apply"))
    messages.append(make_message("/VMC/Ext/OK", 1))
    messages.append(make_message("/VMC/Ext/T", float(seconds)))
    return messages


def make_bundle(messages: Sequence[OscMessage]) -> bytes:
    """Return one datagram with `messages`."""
    builder = OscBundleBuilder(IMMEDIATELY)
    for message in messages:
        builder.add_content(message)
    return builder.build().dgram


def make_message(address: str, *arguments: str | int | float) -> OscMessage:
    builder = OscMessageBuilder(address)
    for argument in arguments:
        kind = {str: builder.ARG_TYPE_STRING, int: builder.ARG_TYPE_INT}.get(type(argument), builder.ARG_TYPE_FLOAT)
        builder.add_arg(argument, kind)
    return builder.build()


def _t_pose_to_rest(source: SourceFit, bone: str, joints: dict[str, int]) -> Array:
    """Return the inverse of the rotation (4,) that brings a bone from the clip's rest pose to the T-pose."""
    for side, _, sign in SIDES:
        if bone.startswith(side) and bone.endswith(("Arm", "Hand")):
            upper, lower, hand = f"{side}UpperArm", f"{side}LowerArm", f"{side}Hand"
            start, end = (upper, lower) if bone == upper or hand not in joints else (lower, hand)
            at_rest = source.fit.rest_positions
            return rotation.conjugate(
                rotation.rotation_between(at_rest[joints[end]] - at_rest[joints[start]], np.array([sign, 0.0, 0.0]))
            )
    return rotation.IDENTITY


def _path(source: SourceMotion, above: int, below: int) -> list[int]:
    chain = ancestor_chain(source.parents, below)
    return chain[: chain.index(above) + 1][::-1]


def _parent_index(source: SourceMotion, sources: list[int], index: int) -> int:
    """Return the bone whose joint is the nearest ancestor, -1 for the hips."""
    above = ancestor_chain(source.parents, sources[index])[1:]
    return next((sources.index(joint) for joint in above if joint in sources), -1)
