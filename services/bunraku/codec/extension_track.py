"""Extension tracks: further joints of a performer beside its motion, and the decoder of their blocks.

proto/codec.md, 2.17, is the definition.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.channel_layout import NONE, ChannelLayout, create_layout
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.integer_coder import decode_integers, encode_integers
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import IntArray, Prior, load_shipped_prior
from bunraku.codec.timing import Timing, parse_timing
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

EXTENSION_TYPE = "extension"
EXTENSION_CODEC = "bunraku.extension/1"
BODY_PART = "body"

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
MAX_EXTENSION_BYTES = 512


@dataclass(frozen=True, slots=True)
class ExtensionTrack(Timing):
    """Timing and joints of the extension of one performer, which has this index among the motion's."""

    performer: int
    extension: BodyExtension
    weights: Array = field(init=False, repr=False)
    """Matrices (E, 3, 3) that convert the values of a joint, in radians, to the scale of the quantiser, metres."""
    inverse_weights: Array = field(init=False, repr=False)
    layout: ChannelLayout = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", _joint_weights(self.extension))
        object.__setattr__(self, "inverse_weights", np.ascontiguousarray(np.linalg.inv(self.weights)))
        object.__setattr__(self, "layout", _create_extension_layout(self.extension.kinds))

    @property
    def kind(self) -> str:
        """Type of the track."""
        return EXTENSION_TYPE


@dataclass(frozen=True, slots=True)
class ExtensionBlock:
    """A decoded block: quantised coefficients `q` (E, 3, K), and the dequantised `values` (E, 3, K) in radians."""

    frames: int
    q: IntArray
    values: Array

    def values_at(self, instants: Array | float) -> Array:
        """Return the values (m, E, 3) at `instants` (m,), in frames from the first, -1/2 .. frames - 1/2."""
        return transform.inverse_dct(self.values, self.frames, np.atleast_1d(np.asarray(instants, dtype=np.float64)))


def decode_extension_block(track: ExtensionTrack, data: bytes, prior: Prior | None = None) -> ExtensionBlock:
    """Decode one block of `track`. Raises `DamagedBlock`.

    `prior` must be the one with which the block was encoded; the default is the shipped prior.
    """
    header, q = coefficients.decode_coefficients(
        prior or load_shipped_prior(), data, track.block_frames, track.fps, track.layout
    )
    values = track.inverse_weights @ (reconstruct(q) * step_size(header.step, header.frames))
    return ExtensionBlock(header.frames, q, values)


def describe_extension_track(track: ExtensionTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """Return the entry of a Description's `tracks` for an extension (proto/messages.md, 3.2)."""
    return {
        "type": EXTENSION_TYPE,
        "codec": EXTENSION_CODEC,
        "channels": len(track.layout.axes),
        "performer": track.performer,
        "part": BODY_PART,
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "first_frames": track.first_frames,
        "rates": rates,
        "joints": pack_extension(track.extension),
    }


def parse_extension_track(description: dict[str, Any]) -> ExtensionTrack:
    """Return the track of `describe_extension_track`. Raises `DamagedBlock` if it is invalid or of another codec."""
    codec, part, performer, joints = (description.get(key) for key in ("codec", "part", "performer", "joints"))
    if codec != EXTENSION_CODEC or part != BODY_PART:
        raise DamagedBlock(f"Unsupported extension of codec {codec!r} and part {part!r}.")
    timing = parse_timing(description, EXTENSION_TYPE)
    if not isinstance(performer, int) or performer < 0 or not isinstance(joints, bytes):
        raise DamagedBlock("Invalid extension track: performer must be an index, and joints must be bytes.")
    return ExtensionTrack(
        timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, unpack_extension(joints)
    )


def pack_extension(extension: BodyExtension) -> bytes:
    """Return the bytes of `joints` that describe an extension."""
    flags = extension.spine_count | _NECK_BIT * extension.has_neck | _CLAVICLES_BIT * extension.has_clavicles
    joints = [
        extension.offsets / LENGTH_UNIT_M,
        extension.rest / REST_UNIT_RAD,
        extension.drive.reshape(-1, 9) / DRIVE_UNIT,
    ]
    numbers = np.concatenate([np.concatenate(joints, axis=1).ravel(), extension.ends.ravel() / LENGTH_UNIT_M])
    groups, mirrors = _integer_models(len(extension.offsets), extension.has_clavicles)
    return bytes([flags]) + encode_integers(np.round(numbers).astype(np.int64), groups, mirrors)


def unpack_extension(data: bytes) -> BodyExtension:
    """Return the extension of `pack_extension`. Raises `DamagedBlock`."""
    flags = data[0] if data else 0
    spine_count, has_neck, has_clavicles = flags & 7, bool(flags & _NECK_BIT), bool(flags & _CLAVICLES_BIT)
    count = spine_count + has_neck + 2 * has_clavicles
    if spine_count > MAX_SPINE_JOINTS or count == 0 or flags >> 5 or len(data) > MAX_EXTENSION_BYTES:
        raise DamagedBlock(
            f"Invalid extension: its first byte is {flags} and it has {len(data)} bytes, expected a neck, clavicles or "
            f"1..{MAX_SPINE_JOINTS} joints of the spine, and at most {MAX_EXTENSION_BYTES} bytes."
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


def _create_extension_layout(kinds: list[JointKind]) -> ChannelLayout:
    """Return the layout of an extension: the spine is a chain, of which neck and clavicles are the last link."""
    spine = kinds.count(JointKind.SPINE)
    parents = [index - 1 if kind is JointKind.SPINE else spine - 1 for index, kind in enumerate(kinds)]
    mirrors = [index - 1 if index else NONE for index in range(len(kinds))]
    return create_layout([_PRIOR_CHANNELS[kind] for kind in kinds], parents, mirrors)


def _joint_weights(extension: BodyExtension) -> Array:
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
