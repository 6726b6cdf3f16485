"""Contacts of feet: tracks, blocks, and the contacts of motion times (`contacts.json`)."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bunraku.codec.extension.contact import (
    ContactTrack,
    decode_contact_block,
    describe_contact_track,
    encode_contacts,
    parse_contact_track,
)
from bunraku.codec.timing import Timing
from bunraku.motion.contact.foot_contact import BoolArray
from bunraku.playout.block_store import ContactBlockStore
from tests.vectors.blocks import to_base64

_STEPS = (((0, 12), (30, 47), (60, 90)), ((0, 9), (22, 23), (40, 90)))
"""First frame of each contact of the left and of the right foot, and the frame after its last."""
_LONG = (((0, 700),), ((150, 660),))
_TIMINGS = (Timing(30.0, 90, 30, 15), Timing(120.0, 700, 300, 100), Timing(23.976, 1, 1, 1))


def _planted(frames: int, contacts: tuple[tuple[tuple[int, int], ...], ...]) -> BoolArray:
    planted = np.zeros((frames, 2), dtype=np.bool_)
    for foot, spans in enumerate(contacts):
        for begin, end in spans:
            planted[begin:end, foot] = True
    return planted


def block_vector(track: ContactTrack, number: int, index: int, data: bytes) -> dict[str, Any]:
    """Return a valid block of track `number` with its contacts, 0 or 1, in each frame."""
    left, right = decode_contact_block(data, track.frames_in(index)).planted.T.astype(int).tolist()
    return {"track": number, "index": index, "block": to_base64(data), "left": left, "right": right}


def position_vectors(number: int, store: ContactBlockStore) -> list[dict[str, Any]]:
    """Return the contacts of some motion times, at the borders of frames and between them."""
    track = store.track
    frames = sorted({*range(0, track.frames, max(track.frames // 9, 1)), track.first_frames, track.frames - 1})
    positions = [position for frame in frames for position in _positions_of(track, frame)]
    return [
        {"track": number, "position": position, "planted": contacts.astype(int).tolist()}
        for position in positions
        if (contacts := store.contacts_at(position)) is not None
    ]


def _positions_of(track: ContactTrack, frame: int) -> list[int]:
    begin = round(frame * 1e6 / track.fps)
    return [max(begin - 2, 0), begin, round((frame + 0.7) * 1e6 / track.fps)]


def load_track(description: dict[str, Any]) -> ContactTrack:
    """Return the track of a golden description."""
    return parse_contact_track(description)


def make_vectors() -> dict[str, Any]:
    """Return tracks, their blocks, contacts of motion times, and invalid blocks and descriptions."""
    parts = [_STEPS, _LONG, ((), ((0, 1),))]
    encoded = [
        encode_contacts(_planted(timing.frames, contacts), timing, number)
        for number, (timing, contacts) in enumerate(zip(_TIMINGS, parts, strict=True))
    ]
    valid, positions = [], []
    for number, each in enumerate(encoded):
        store = ContactBlockStore(each.track)
        for index, block in enumerate(each.ladder[0].blocks):
            valid.append(block_vector(each.track, number, index, block))
            store.put_encoded(index, 0, block)
        positions += position_vectors(number, store)
    frames = encoded[0].track.frames_in(1)
    invalid = {
        "no runs": b"",
        "no runs of the right foot": bytes([frames]),
        "a run beyond the block": bytes([frames, frames + 1]),
        "a byte after the last run": bytes([frames, frames, 0]),
        "an empty run at the start with contact": bytes([0, 0, frames, frames]),
        "an empty run": bytes([10, 0, frames - 10, frames]),
        "an integer without end": bytes([frames, 128 | frames]),
    }
    changes: dict[str, dict[str, Any]] = {
        "another codec": {"codec": "bunraku.contact/9"},
        "negative performer": {"performer": -1},
        "no frames": {"frames": 0},
    }
    described = describe_contact_track(encoded[0].track, encoded[0].describe()["rates"])
    return {
        "tracks": [each.describe() for each in encoded],
        "valid": valid,
        "positions": positions,
        "invalid": [{"why": why, "block": to_base64(data), "index": 1} for why, data in invalid.items()],
        "invalid_tracks": [{"why": why, "track": described | change} for why, change in changes.items()],
    }


def unpack(vector: dict[str, Any]) -> bytes:
    """Return the bytes of a golden block."""
    return base64.b64decode(vector["block"])
