"""Message 5 and 14: pulled limbs at an instant (SPEC.md, Overlay)."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import ClassVar

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import LIMBS, MOST_LIMBS

_ONE = struct.Struct("<BBHQ")
_SEVERAL = struct.Struct("<BBHQH")


@dataclass(frozen=True, slots=True)
class Overlay:
    """Pulled limbs at clock time `due`: limb -> three rotation vectors of its joints, in units of pi/32767.

    `earlier` are the same limbs in the frames before, oldest first, each `FRAME` µs after the one before it.
    """

    TYPE: ClassVar[int] = 5
    SEVERAL: ClassVar[int] = 14
    """The type where limbs of others than the first performer are among them."""
    FRAME: ClassVar[int] = 16_667
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
            return _ONE.pack(self.TYPE, mask | more, self.sequence & 0xFFFF, self.due) + frames
        return _SEVERAL.pack(self.SEVERAL, more, self.sequence & 0xFFFF, self.due, mask) + frames

    @classmethod
    def unpack(cls, data: bytes) -> Overlay:
        """The message of `pack`."""
        begin = _head(data)
        if len(data) < begin:
            raise MalformedMessage(f"Overlay has {begin} bytes at least")
        limbs = _limbs(data)
        count = (data[1] >> 4) + 1
        size = begin + 18 * len(limbs) * count
        if len(data) != size:
            raise MalformedMessage(f"Overlay of {len(limbs)} limbs has {size} bytes, not {len(data)}")
        _, _, sequence, due = _ONE.unpack_from(data)
        numbers = struct.unpack_from(f"<{(size - begin) // 2}h", data, begin)
        parts = [tuple(numbers[at : at + 9]) for at in range(0, len(numbers), 9)]
        frames = [
            dict(zip(limbs, parts[len(limbs) * frame : len(limbs) * (frame + 1)], strict=True))
            for frame in range(count)
        ]
        return cls(sequence, due, frames[-1], tuple(frames[:-1]))


def _head(data: bytes) -> int:
    return (_ONE if data[0] == Overlay.TYPE else _SEVERAL).size


def _limbs(data: bytes) -> list[int]:
    mask = data[1] & 15 if data[0] == Overlay.TYPE else data[12] | data[13] << 8
    return [limb for limb in range(MOST_LIMBS) if mask >> limb & 1]


def newest(overlay: bytes) -> bytes:
    """An Overlay's message with its last frame alone, for a line that does not carry all."""
    begin, limbs = _head(overlay), _limbs(overlay)
    return bytes((overlay[0], overlay[1] & 15)) + overlay[2:begin] + overlay[len(overlay) - 18 * len(limbs) :]
