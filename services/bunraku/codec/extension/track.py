"""Tracks of extensions and the decoder of their blocks (proto/codec.md, 2.17-2.19)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from bunraku.codec import coefficients, transform
from bunraku.codec.channel_layout import ChannelLayout
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.body_joints import body_weights, create_body_layout, pack_body, unpack_body
from bunraku.codec.extension.face_axes import create_face_layout, face_weights, pack_face, unpack_face
from bunraku.codec.extension.finger_joints import create_finger_layout, finger_weights, pack_fingers, unpack_fingers
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import IntArray, Prior, load_shipped_prior
from bunraku.codec.timing import Timing, parse_timing
from bunraku.motion.extension import BodyExtension
from bunraku.motion.face import Face
from bunraku.motion.hands import Hands
from bunraku.motion.rotation import Array

EXTENSION_TYPE = "extension"
Extension = BodyExtension | Hands | Face
"""What is beside a performer's channels."""
_NO_OFFSETS: IntArray = np.zeros(0, dtype=np.int64)


class ExtensionPart(StrEnum):
    """Part of a performer that an extension adds. Contacts and props have tracks of their own (`contact`, `props`)."""

    BODY = "body"
    FINGERS = "fingers"
    FACE = "face"
    CONTACTS = "contacts"
    PROPS = "props"


class _Format(NamedTuple):
    """Coding of one part: the codec's name, the key of the description, and functions of the part's module."""

    codec: str
    key: str
    model: type
    pack: Callable[[Any, IntArray], bytes]
    unpack: Callable[[bytes], tuple[Any, IntArray]]
    create_layout: Callable[[Any, IntArray], ChannelLayout]
    weights: Callable[[Any], Array]


_FORMATS = {
    ExtensionPart.BODY: _Format(
        "bunraku.extension/1",
        "joints",
        BodyExtension,
        lambda extension, _: pack_body(extension),
        lambda data: (unpack_body(data), _NO_OFFSETS),
        lambda extension, _: create_body_layout(extension),
        body_weights,
    ),
    ExtensionPart.FINGERS: _Format(
        "bunraku.extension/2", "joints", Hands, pack_fingers, unpack_fingers, create_finger_layout, finger_weights
    ),
    ExtensionPart.FACE: _Format(
        "bunraku.extension/2", "axes", Face, pack_face, unpack_face, create_face_layout, face_weights
    ),
}


@dataclass(frozen=True, slots=True)
class ExtensionTrack(Timing):
    """Timing and content of an extension of one performer, which has this index among the motion's.

    `scale_offsets` are those of the axes of a part with offsets, in the order in which the axes are coded.
    """

    performer: int
    extension: Extension
    scale_offsets: IntArray = field(default_factory=lambda: _NO_OFFSETS, repr=False)
    weights: Array = field(init=False, repr=False)
    """Matrices (E, 3, 3) that convert the values of a channel to the scale of the quantiser."""
    inverse_weights: Array = field(init=False, repr=False)
    layout: ChannelLayout = field(init=False, repr=False)

    def __post_init__(self) -> None:
        coding = _FORMATS[self.part]
        object.__setattr__(self, "weights", coding.weights(self.extension))
        object.__setattr__(self, "inverse_weights", np.ascontiguousarray(np.linalg.inv(self.weights)))
        object.__setattr__(self, "layout", coding.create_layout(self.extension, self.scale_offsets))

    @property
    def kind(self) -> str:
        """Type of the track."""
        return EXTENSION_TYPE

    @property
    def part(self) -> ExtensionPart:
        """Part of the performer."""
        return part_of(self.extension)

    def pack_extension(self) -> bytes:
        """Return the bytes that describe the extension."""
        return _FORMATS[self.part].pack(self.extension, self.scale_offsets)


def part_of(extension: Extension) -> ExtensionPart:
    """Return the part of the performer that an extension adds."""
    return next(part for part, coding in _FORMATS.items() if isinstance(extension, coding.model))


@dataclass(frozen=True, slots=True)
class ExtensionBlock:
    """A decoded block: quantised coefficients `q` (E, 3, K), and the dequantised `values` (E, 3, K)."""

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
    coding = _FORMATS[track.part]
    return {
        "type": EXTENSION_TYPE,
        "codec": coding.codec,
        "channels": len(track.layout.axes),
        "performer": track.performer,
        "part": track.part.value,
        **track.describe_timing(),
        "rates": rates,
        coding.key: track.pack_extension(),
    }


def is_index(value: Any) -> TypeGuard[int]:
    """Return whether a value of a description is an index: an integer from 0 on, and no boolean."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def parse_extension_track(description: dict[str, Any]) -> ExtensionTrack:
    """Return the track of `describe_extension_track`. Raises `DamagedBlock` if it is invalid or of another codec."""
    codec, part, performer = (description.get(key) for key in ("codec", "part", "performer"))
    coding = next((coding for name, coding in _FORMATS.items() if (coding.codec, name.value) == (codec, part)), None)
    if coding is None:
        raise DamagedBlock(f"Unsupported extension of codec {codec!r} and part {part!r}.")
    timing = parse_timing(description, EXTENSION_TYPE)
    packed = description.get(coding.key)
    if not is_index(performer) or not isinstance(packed, bytes):
        raise DamagedBlock(f"Invalid extension track: performer must be an index, and {coding.key} must be bytes.")
    return ExtensionTrack(
        timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, *coding.unpack(packed)
    )
