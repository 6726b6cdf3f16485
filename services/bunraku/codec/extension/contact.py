"""Contacts of a performer's feet with the floor: their track and the codec of its blocks (proto/codec.md, 2.20)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.track import EXTENSION_TYPE, ExtensionPart, is_index
from bunraku.codec.leb128 import decode_leb128, encode_leb128
from bunraku.codec.timing import Timing, parse_timing
from bunraku.motion.contact.foot_contact import FEET, BoolArray

CONTACT_CODEC = "bunraku.contact/1"


@dataclass(frozen=True, slots=True)
class ContactTrack(Timing):
    """Timing of the contacts of one performer, which has this index among the motion's."""

    performer: int

    @property
    def kind(self) -> str:
        """Type of the track."""
        return EXTENSION_TYPE

    @property
    def part(self) -> ExtensionPart:
        """Part of the performer."""
        return ExtensionPart.CONTACTS


@dataclass(frozen=True, slots=True)
class ContactBlock:
    """A decoded block: whether the left and the right foot are planted in each frame (n, 2)."""

    planted: BoolArray

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.planted)


class ContactLevel(NamedTuple):
    """The one encoding of a track of contacts: its blocks and its bitrate."""

    blocks: list[bytes]
    kbps: float


@dataclass(frozen=True, slots=True)
class EncodedContacts:
    """Contacts of one performer. They are exact, so that the ladder has one level."""

    track: ContactTrack
    ladder: list[ContactLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_contact_track(
            self.track, [{"kbps": level.kbps, "mean": 0.0, "max": 0.0} for level in self.ladder]
        )


def encode_contacts(planted: BoolArray, timing: Timing, performer: int = 0) -> EncodedContacts:
    """Encode contacts (n, 2) in the blocks of their motion; `performer` is the index of the performer."""
    track = ContactTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer)
    blocks = []
    for index in range(track.block_count):
        start = track.first_frame(index)
        blocks.append(pack_contact_block(planted[start : start + track.frames_in(index)]))
    kbps = sum(map(len, blocks)) * 8e-3 * track.fps / track.frames
    return EncodedContacts(track, [ContactLevel(blocks, kbps)])


def pack_contact_block(planted: BoolArray) -> bytes:
    """Return the block of contacts (n, 2): of each foot the lengths of its runs, the first without contact."""
    lengths: list[int] = []
    for foot in planted.T:
        ends = np.flatnonzero(np.diff(np.concatenate([[False], foot])))
        lengths += np.diff([0, *ends.tolist(), len(foot)]).tolist()
    return b"".join(map(encode_leb128, lengths))


def decode_contact_block(data: bytes, frames: int) -> ContactBlock:
    """Return the contacts of a block of `frames` frames. Raises `DamagedBlock`."""
    planted, offset = np.zeros((frames, len(FEET)), dtype=np.bool_), 0
    for foot in range(len(FEET)):
        end, is_planted = 0, False
        while end < frames:
            length, offset = decode_leb128(data, offset)
            begin, end = end, end + length
            # only the first run, without contact, may be empty
            if end > frames or (length == 0 and (begin > 0 or is_planted)):
                raise DamagedBlock(f"Invalid contacts: a run of {length} frames at frame {begin} of {frames}.")
            planted[begin:end, foot] = is_planted
            is_planted = not is_planted
    if offset != len(data):
        raise DamagedBlock(f"Invalid contacts: {len(data)} bytes, expected {offset} for {frames} frames.")
    return ContactBlock(planted)


def describe_contact_track(track: ContactTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """Return the entry of a Description's `tracks` for contacts (proto/messages.md, 3.2)."""
    return {
        "type": EXTENSION_TYPE,
        "codec": CONTACT_CODEC,
        "channels": len(FEET),
        "performer": track.performer,
        "part": track.part.value,
        **track.describe_timing(),
        "rates": rates,
    }


def parse_contact_track(description: dict[str, Any]) -> ContactTrack:
    """Return the track of `describe_contact_track`. Raises `DamagedBlock` if it is invalid or of another codec."""
    if description.get("codec") != CONTACT_CODEC:
        raise DamagedBlock(f"Unsupported codec of contacts {description.get('codec')!r}, expected {CONTACT_CODEC!r}.")
    timing = parse_timing(description, EXTENSION_TYPE)
    performer = description.get("performer")
    if not is_index(performer):
        raise DamagedBlock("Invalid track of contacts: performer must be an index.")
    return ContactTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer)
