"""Props of a motion: their track and the codec of its blocks (proto/codec.md, 2.21)."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.track import EXTENSION_TYPE, ExtensionPart, is_index
from bunraku.codec.leb128 import decode_leb128, encode_leb128
from bunraku.codec.timing import Timing, parse_timing
from bunraku.motion.placement import Placement
from bunraku.wire.limbs import LIMBS, MAX_LIMBS, is_hand
from bunraku.wire.prop import MAX_PROPS, PropState

PROP_CODEC = "bunraku.prop/1"

ShownState = PropState | None
"""State of a prop in one frame, None while it is not on the stage."""
_ABSENT, _ON_FLOOR, _IN_LIMB = 0, 1, 2
_PLACE = struct.Struct("<3f")


@dataclass(frozen=True, slots=True)
class PropTrack(Timing):
    """Timing of the props of a motion and their kinds; limbs count from those of the performer of this index."""

    performer: int
    kinds: tuple[str, ...]

    @property
    def kind(self) -> str:
        """Type of the track."""
        return EXTENSION_TYPE

    @property
    def part(self) -> ExtensionPart:
        """Part of the performer."""
        return ExtensionPart.PROPS


@dataclass(frozen=True, slots=True)
class PropBlock:
    """A decoded block: the state of each prop in each frame, `states[prop][frame]`."""

    states: tuple[tuple[ShownState, ...], ...]

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.states[0])


class PropLevel(NamedTuple):
    """The one encoding of a track of props: its blocks and its bitrate."""

    blocks: list[bytes]
    kbps: float


@dataclass(frozen=True, slots=True)
class EncodedProps:
    """Props of a motion. They are exact, so that the ladder has one level."""

    track: PropTrack
    ladder: list[PropLevel]

    def describe(self) -> dict[str, Any]:
        """Return the entry of a Description's `tracks`."""
        return describe_prop_track(self.track, [{"kbps": level.kbps, "mean": 0.0, "max": 0.0} for level in self.ladder])


def encode_props(
    kinds: Sequence[str], states: Sequence[Sequence[ShownState]], timing: Timing, performer: int = 0
) -> EncodedProps:
    """Encode the states of props of these kinds, `states[prop][frame]`, in the blocks of their motion."""
    track = PropTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, tuple(kinds))
    blocks = []
    for index in range(track.block_count):
        start = track.first_frame(index)
        blocks.append(pack_prop_block([each[start : start + track.frames_in(index)] for each in states]))
    kbps = sum(map(len, blocks)) * 8e-3 * track.fps / track.frames
    return EncodedProps(track, [PropLevel(blocks, kbps)])


def pack_prop_block(states: Sequence[Sequence[ShownState]]) -> bytes:
    """Return the block of `states[prop][frame]`: of each prop the runs of equal states."""
    runs = []
    for each in states:
        # states that are shown alike are equal: a prop in a hand keeps no place
        for state, frames in groupby(map(_pack_state, each)):
            runs.append(encode_leb128(len(list(frames))) + state)
    return b"".join(runs)


def decode_prop_block(data: bytes, prop_count: int, frames: int) -> PropBlock:
    """Return the states of a block of `frames` frames. Raises `DamagedBlock`."""
    states, offset = [], 0
    for _ in range(prop_count):
        each: list[ShownState] = []
        while len(each) < frames:
            length, offset = decode_leb128(data, offset)
            if not 0 < length <= frames - len(each):
                raise DamagedBlock(f"Invalid props: a run of {length} frames at frame {len(each)} of {frames}.")
            state, offset = _unpack_state(data, offset)
            each += [state] * length
        states.append(tuple(each))
    if offset != len(data):
        raise DamagedBlock(f"Invalid props: {len(data)} bytes, expected {offset}.")
    return PropBlock(tuple(states))


def shift_limb(state: ShownState, performer: int) -> ShownState:
    """Return a state whose limb counts from those of the performer of this index, with its number on the stage."""
    if state is None or state.limb is None:
        return state
    return state._replace(limb=state.limb + performer * len(LIMBS))


def describe_prop_track(track: PropTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """Return the entry of a Description's `tracks` for props (proto/messages.md, 3.2)."""
    return {
        "type": EXTENSION_TYPE,
        "codec": PROP_CODEC,
        "channels": len(track.kinds),
        "performer": track.performer,
        "part": track.part.value,
        "kinds": list(track.kinds),
        **track.describe_timing(),
        "rates": rates,
    }


def parse_prop_track(description: dict[str, Any]) -> PropTrack:
    """Return the track of `describe_prop_track`. Raises `DamagedBlock` if it is invalid or of another codec."""
    if description.get("codec") != PROP_CODEC:
        raise DamagedBlock(f"Unsupported codec of props {description.get('codec')!r}, expected {PROP_CODEC!r}.")
    timing = parse_timing(description, EXTENSION_TYPE)
    performer, kinds = description.get("performer"), description.get("kinds")
    if not is_index(performer):
        raise DamagedBlock("Invalid track of props: performer must be an index.")
    if (
        not isinstance(kinds, list)
        or not 1 <= len(kinds) <= MAX_PROPS
        or not all(isinstance(kind, str) for kind in kinds)
    ):
        raise DamagedBlock(f"Invalid track of props: kinds must be a list of 1 to {MAX_PROPS} texts.")
    return PropTrack(timing.fps, timing.frames, timing.block_frames, timing.first_frames, performer, tuple(kinds))


def _pack_state(state: ShownState) -> bytes:
    if state is None:
        return bytes([_ABSENT])
    if state.limb is None:
        return bytes([_ON_FLOOR]) + _PLACE.pack(*state.place)
    return bytes([_IN_LIMB + state.limb])


def _unpack_state(data: bytes, offset: int) -> tuple[ShownState, int]:
    code, offset = data[offset] if offset < len(data) else -1, offset + 1
    if code == _ABSENT:
        return None, offset
    if code == _ON_FLOOR:
        try:
            return PropState(None, Placement.parse(_PLACE.unpack_from(data, offset))), offset + _PLACE.size
        except (struct.error, ValueError) as error:
            raise DamagedBlock(f"Invalid props: {error}.") from None
    limb = code - _IN_LIMB
    if not 0 <= limb < MAX_LIMBS or not is_hand(limb):
        raise DamagedBlock(f"Invalid props: no state {code}.")
    return PropState(limb), offset
