"""Body extension in a track: description of its joints, layout of its blocks, and weights (proto/codec.md, 2.17)."""

from __future__ import annotations

import numpy as np

from bunraku.codec.channel_layout import NONE, ChannelLayout, create_layout
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.integer_coder import decode_integers, encode_integers
from bunraku.codec.prior import IntArray
from bunraku.motion.extension import (
    DRIVE_UNIT,
    LENGTH_UNIT_M,
    MAX_SPINE_JOINTS,
    REST_UNIT_RAD,
    BodyExtension,
    JointKind,
)
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX

_TWIST_RADIUS_M = 0.04
"""Lever arm about a bone, for what turns with it."""
_PRIOR_CHANNELS = {
    JointKind.SPINE: JOINT_INDEX["vl5"] + 1,
    JointKind.NECK: JOINT_INDEX["skullbase"] + 1,
    JointKind.LEFT_CLAVICLE: JOINT_INDEX["l_shoulder"] + 1,
    JointKind.RIGHT_CLAVICLE: JOINT_INDEX["r_shoulder"] + 1,
}
"""Channels of a motion whose biases the prior applies to an extension's joints."""
_NECK_BIT, _CLAVICLES_BIT = 8, 16
_ROW = 15
"""Integers of a joint: offset, rest and drive."""
MAX_BODY_BYTES = 512


def pack_body(extension: BodyExtension) -> bytes:
    """Return the bytes of `joints` that describe a body extension."""
    flags = extension.spine_count | _NECK_BIT * extension.has_neck | _CLAVICLES_BIT * extension.has_clavicles
    joints = [
        extension.offsets / LENGTH_UNIT_M,
        extension.rest / REST_UNIT_RAD,
        extension.drive.reshape(-1, 9) / DRIVE_UNIT,
    ]
    numbers = np.concatenate([np.concatenate(joints, axis=1).ravel(), extension.ends.ravel() / LENGTH_UNIT_M])
    groups, mirrors = _integer_models(len(extension.offsets), extension.has_clavicles)
    return bytes([flags]) + encode_integers(np.round(numbers).astype(np.int64), groups, mirrors)


def unpack_body(data: bytes) -> BodyExtension:
    """Return the extension of `pack_body`. Raises `DamagedBlock`."""
    flags = data[0] if data else 0
    spine_count, has_neck, has_clavicles = flags & 7, bool(flags & _NECK_BIT), bool(flags & _CLAVICLES_BIT)
    count = spine_count + has_neck + 2 * has_clavicles
    if spine_count > MAX_SPINE_JOINTS or count == 0 or flags >> 5 or len(data) > MAX_BODY_BYTES:
        raise DamagedBlock(
            f"Invalid extension: its first byte is {flags} and it has {len(data)} bytes, expected a neck, clavicles or "
            f"1..{MAX_SPINE_JOINTS} joints of the spine, and at most {MAX_BODY_BYTES} bytes."
        )
    integers = decode_integers(data[1:], *_integer_models(count, has_clavicles)).astype(np.float64)
    joints = integers[: count * _ROW].reshape(count, _ROW)
    return BodyExtension(
        spine_count,
        has_neck,
        has_clavicles,
        offsets=joints[:, :3] * LENGTH_UNIT_M,
        ends=integers[count * _ROW :].reshape(3, 3) * LENGTH_UNIT_M,
        drive=joints[:, 6:].reshape(-1, 3, 3) * DRIVE_UNIT,
        rest=joints[:, 3:6] * REST_UNIT_RAD,
    )


def _integer_models(count: int, has_clavicles: bool) -> tuple[IntArray, IntArray]:
    """Return the group of models of each integer that describes `count` joints, and the integer that it mirrors.

    Groups are lengths by axis (0-2), rests (3), the diagonals of drives (4), their other elements (5), mirrored lengths
    (6), and other mirrored integers (7).
    """
    joint = [0, 1, 2, 3, 3, 3, *(4 if row == column else 5 for row in range(3) for column in range(3))]
    groups, mirrors = joint * count + [0, 1, 2] * 3, [-1] * (count * _ROW + 9)
    right_shoulder = range(count * _ROW + 6, count * _ROW + 9)
    right_clavicle = range((count - 1) * _ROW, count * _ROW) if has_clavicles else range(0)
    for twins, distance in ((right_clavicle, _ROW), (right_shoulder, 3)):
        for index in twins:
            mirrors[index] = index - distance
            groups[index] = 6 if groups[index] < 3 else 7
    return np.array(groups, dtype=np.int64), np.array(mirrors, dtype=np.int64)


def create_body_layout(extension: BodyExtension) -> ChannelLayout:
    """Return the layout of the blocks: the spine is a chain, of which neck and clavicles are the last link."""
    kinds = extension.kinds
    spine = kinds.count(JointKind.SPINE)
    parents = [index - 1 if kind is JointKind.SPINE else spine - 1 for index, kind in enumerate(kinds)]
    mirrors = [index - 1 if index else NONE for index in range(len(kinds))]
    return create_layout([_PRIOR_CHANNELS[kind] for kind in kinds], parents, mirrors)


def body_weights(extension: BodyExtension) -> Array:
    """Return the weights (E, 3, 3): the lever arm about each axis of what a joint carries, in metres."""
    left, right = extension.ends[1], extension.ends[2]
    if extension.has_clavicles:
        left, right = left + extension.offsets[-2], right + extension.offsets[-1]
    radius = float(np.linalg.norm(left - right)) / 2
    arm, weights = (left + right) / 2, []
    for index in range(len(extension.offsets) - 1, -1, -1):
        kind = extension.kinds[index]
        if kind is JointKind.SPINE:
            weights.append(_lever_weight(arm, radius))
            arm = arm + extension.offsets[index]
        else:
            end = {JointKind.NECK: 0, JointKind.LEFT_CLAVICLE: 1, JointKind.RIGHT_CLAVICLE: 2}[kind]
            weights.append(_lever_weight(extension.ends[end], 0.0))
    return np.array(weights[::-1])


def _lever_weight(arm: Array, radius: float) -> Array:
    """Return the weight (3, 3) of a joint that carries a point at `arm` (3,), and others around it at `radius`."""
    square = _TWIST_RADIUS_M**2 + radius**2
    length = float(np.linalg.norm(arm))
    along = np.outer(arm, arm) / max(length, 1e-9) ** 2
    weight: Array = np.sqrt(square) * along + np.sqrt(square + length**2) * (np.eye(3) - along)
    return weight
