"""Message 5 and 14: pulled limbs at an instant (SPEC.md, Overlay)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import ClassVar

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import LIMBS, MAX_LIMBS

_SINGLE_PERFORMER_HEADER = struct.Struct("<BBHQ")
_MULTI_PERFORMER_HEADER = struct.Struct("<BBHQH")


@dataclass(frozen=True, slots=True)
class Overlay:
    """Pulled limbs at clock time `due`: limb -> three rotation vectors of its joints, in units of pi/32767.

    `earlier` are the same limbs in the frames before, oldest first, each `FRAME` µs after the one before it.
    """

    TYPE: ClassVar[int] = 5
    MULTI_PERFORMER_TYPE: ClassVar[int] = 14
    """The type where limbs of others than the first performer are among them."""
    FRAME_INTERVAL_US: ClassVar[int] = 16_667
    sequence: int
    due: int
    limbs: dict[int, tuple[int, ...]]
    earlier: tuple[dict[int, tuple[int, ...]], ...] = ()

    def pack(self) -> bytes:
        """The message as bytes: 12 (of several performers 14) and 18 a limb and frame."""
        limbs = sorted(self.limbs)
        mask, more = sum(1 << limb for limb in limbs), len(self.earlier) << 4
        numbers = [n for frame in (*self.earlier, self.limbs) for limb in limbs for n in frame[limb]]
        frames = struct.pack(f"<{len(numbers)}h", *numbers)
        if mask < 1 << len(LIMBS):
            return _SINGLE_PERFORMER_HEADER.pack(self.TYPE, mask | more, self.sequence & 0xFFFF, self.due) + frames
        return (
            _MULTI_PERFORMER_HEADER.pack(self.MULTI_PERFORMER_TYPE, more, self.sequence & 0xFFFF, self.due, mask)
            + frames
        )

    @classmethod
    def unpack(cls, data: bytes) -> Overlay:
        """The message of `pack`."""
        begin = _header_size(data)
        if len(data) < begin:
            raise MalformedMessage(f"Overlay has {begin} bytes at least")
        limbs = _limb_numbers(data)
        count = (data[1] >> 4) + 1
        size = begin + 18 * len(limbs) * count
        if len(data) != size:
            raise MalformedMessage(f"Overlay of {len(limbs)} limbs has {size} bytes, not {len(data)}")
        _, _, sequence, due = _SINGLE_PERFORMER_HEADER.unpack_from(data)
        numbers = struct.unpack_from(f"<{(size - begin) // 2}h", data, begin)
        parts = [tuple(numbers[at : at + 9]) for at in range(0, len(numbers), 9)]
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
    """An Overlay's message with its last frame alone, for a line that does not carry all."""
    begin, limbs = _header_size(message), _limb_numbers(message)
    return bytes((message[0], message[1] & 15)) + message[2:begin] + message[len(message) - 18 * len(limbs) :]
