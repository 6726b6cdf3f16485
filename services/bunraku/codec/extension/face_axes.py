"""Face in a track: description of its axes, and layout of its blocks (proto/codec.md, 2.19)."""

from __future__ import annotations

import numpy as np

from bunraku.codec.channel_layout import NONE, ChannelLayout, create_layout
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.scale_offsets import check_scale_offsets, to_scales
from bunraku.codec.integer_coder import decode_integers, encode_integers
from bunraku.codec.prior import IntArray
from bunraku.motion.face import AXIS_COUNT, Face
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX

MAX_FACE_BYTES = 256
_MASK_BYTES = AXIS_COUNT // 8
_PRIOR_CHANNEL = JOINT_INDEX["l_wrist"] + 1


def pack_face(face: Face, offsets: IntArray) -> bytes:
    """Return the bytes of `axes` that describe a face and the offsets (A,) of the scales of its axes."""
    mask = sum(1 << axis for axis in face.axes)
    return mask.to_bytes(_MASK_BYTES, "little") + encode_integers(offsets, *_integer_models(len(face.axes)))


def unpack_face(data: bytes) -> tuple[Face, IntArray]:
    """Return the face and offsets of `pack_face`. Raises `DamagedBlock`."""
    mask = int.from_bytes(data[:_MASK_BYTES], "little")
    if not mask or not _MASK_BYTES <= len(data) <= MAX_FACE_BYTES:
        raise DamagedBlock(
            f"Invalid face: its description has {len(data)} bytes, expected axes and {_MASK_BYTES}..{MAX_FACE_BYTES} "
            "bytes."
        )
    axes = tuple(axis for axis in range(AXIS_COUNT) if mask >> axis & 1)
    return Face(axes), check_scale_offsets(decode_integers(data[_MASK_BYTES:], *_integer_models(len(axes))))


def _integer_models(count: int) -> tuple[IntArray, IntArray]:
    return np.zeros(count, dtype=np.int64), np.full(count, NONE, dtype=np.int64)


def create_face_layout(face: Face, offsets: IntArray) -> ChannelLayout:
    """Return the layout of the blocks: three axes a channel, each channel related to the two before it."""
    count = len(face.axes)
    channels = -(-count // 3)
    return create_layout(
        [_PRIOR_CHANNEL] * channels,
        [channel - 1 for channel in range(channels)],
        [channel - 2 if channel > 1 else NONE for channel in range(channels)],
        [min(3, count - 3 * channel) for channel in range(channels)],
        scale_offsets=to_scales(offsets, channels),
    )


def face_weights(face: Face) -> Array:
    """Return the weights (C, 3, 3) of the channels: all axes count the same."""
    return np.tile(np.eye(3), (-(-len(face.axes) // 3), 1, 1))
