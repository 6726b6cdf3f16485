"""Messages 5 and 14: joints of controlled limbs at an instant (proto/messages.md, 3.5)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import ClassVar

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import LIMBS, MAX_LIMBS

_SINGLE_PERFORMER_HEADER = struct.Struct("<BBHQ")
_MULTI_PERFORMER_HEADER = struct.Struct("<BBHQH")
_LIMB_VALUES = 9
_LIMB_BYTES = 2 * _LIMB_VALUES


@dataclass(frozen=True, slots=True)
class Overlay:
    """Joints of the controlled limbs at clock time `due`.

    `limbs` maps a limb to three rotation vectors, one per joint, as nine integers in units of pi/32767. `earlier` has
    the same limbs in the frames before, oldest first, `FRAME_INTERVAL_US` apart.
    """

    TYPE: ClassVar[int] = 5
    MULTI_PERFORMER_TYPE: ClassVar[int] = 14
    """Type of the message if it holds a limb of another performer than the first."""
    FRAME_INTERVAL_US: ClassVar[int] = 16_667
    sequence: int
    due: int
    limbs: dict[int, tuple[int, ...]]
    earlier: tuple[dict[int, tuple[int, ...]], ...] = ()

    def pack(self) -> bytes:
        """Encode the message: a header of 12 bytes (14 for several performers) and 18 bytes per limb and frame."""
        limbs = sorted(self.limbs)
        mask, frame_count_bits = sum(1 << limb for limb in limbs), len(self.earlier) << 4
        numbers = [n for frame in (*self.earlier, self.limbs) for limb in limbs for n in frame[limb]]
        frames = struct.pack(f"<{len(numbers)}h", *numbers)
        sequence = self.sequence & 0xFFFF
        if mask < 1 << len(LIMBS):
            return _SINGLE_PERFORMER_HEADER.pack(self.TYPE, mask | frame_count_bits, sequence, self.due) + frames
        header = _MULTI_PERFORMER_HEADER.pack(self.MULTI_PERFORMER_TYPE, frame_count_bits, sequence, self.due, mask)
        return header + frames

    @classmethod
    def unpack(cls, data: bytes) -> Overlay:
        """Decode a message of either type; raises `MalformedMessage`."""
        begin = _header_size(data)
        if len(data) < begin:
            raise MalformedMessage(f"Overlay has {len(data)} bytes, expected at least {begin} bytes")
        limbs = _limb_numbers(data)
        count = (data[1] >> 4) + 1
        size = begin + _LIMB_BYTES * len(limbs) * count
        if len(data) != size:
            raise MalformedMessage(
                f"Overlay has {len(data)} bytes, expected {size} bytes for {count} frames of {len(limbs)} limbs"
            )
        _, _, sequence, due = _SINGLE_PERFORMER_HEADER.unpack_from(data)
        numbers = struct.unpack_from(f"<{(size - begin) // 2}h", data, begin)
        parts = [tuple(numbers[at : at + _LIMB_VALUES]) for at in range(0, len(numbers), _LIMB_VALUES)]
        frames = [
            dict(zip(limbs, parts[len(limbs) * frame : len(limbs) * (frame + 1)], strict=True))
            for frame in range(count)
        ]
        return cls(sequence, due, frames[-1], tuple(frames[:-1]))


def _header_size(data: bytes) -> int:
    return (_SINGLE_PERFORMER_HEADER if data[0] == Overlay.TYPE else _MULTI_PERFORMER_HEADER).size


def _limb_numbers(data: bytes) -> list[int]:
    mask = data[1] & 15 if data[0] == Overlay.TYPE else data[12] | data[13] << 8
    return [limb for limb in range(MAX_LIMBS) if mask >> limb & 1]


def drop_earlier_frames(message: bytes) -> bytes:
    """Return an encoded Overlay reduced to its last frame, for a constrained link."""
    begin, limbs = _header_size(message), _limb_numbers(message)
    return bytes((message[0], message[1] & 15)) + message[2:begin] + message[len(message) - _LIMB_BYTES * len(limbs) :]
