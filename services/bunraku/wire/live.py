"""Messages 15 and 72: poses of live performers, and the samples that performers send (proto/messages.md, 3.10)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import MAX_PERFORMERS
from bunraku.wire.overlay import Overlay

MAX_LIVE_FRAMES = 16
"""Most frames of one message."""
MAX_LIVE_BLOCK_BYTES = (1 << 14) - 1
"""Largest block of a performer: two bytes of LEB128."""
MAX_ROOT_M = 100.0
"""Bound of each coordinate of a sample's root."""
AGE_UNIT_US = 4_000
"""Unit in which the age of poses is sent."""
MAX_AGE_US = 255 * AGE_UNIT_US
_HEADER = struct.Struct("<BBQ")


@dataclass(frozen=True, slots=True)
class LiveBlock:
    """Block of the frames of one performer (proto/codec.md, 2.16)."""

    age_us: int
    """Time from the capture of a pose until it is due, sent in units of `AGE_UNIT_US`, at most `MAX_AGE_US`."""
    data: bytes


@dataclass(frozen=True, slots=True)
class Live:
    """Whole poses of live performers in `frames` frames, the last at clock time `due`.

    `blocks` maps a performer to a block of its frames. No message depends on another, so that any may be lost or
    skipped. A message without blocks says that no performer is live any more.
    """

    TYPE: ClassVar[int] = 15
    FRAME_INTERVAL_US: ClassVar[int] = Overlay.FRAME_INTERVAL_US
    due: int
    frames: int
    blocks: dict[int, LiveBlock]

    def pack(self) -> bytes:
        """Encode the message: 10 bytes, and 2 or 3 bytes and the block of each performer."""
        mask = sum(1 << performer for performer in self.blocks)
        parts = [_HEADER.pack(self.TYPE, self.frames - 1 << 4 | mask, self.due)]
        for performer in sorted(self.blocks):
            block = self.blocks[performer]
            age, size = min(round(block.age_us / AGE_UNIT_US), 255), len(block.data)
            parts += (bytes([age, size] if size < 128 else [age, size & 127 | 128, size >> 7]), block.data)
        return b"".join(parts)

    @classmethod
    def unpack(cls, data: bytes) -> Live:
        """Decode a message; raises `MalformedMessage`."""
        if len(data) < _HEADER.size:
            raise MalformedMessage(f"Live has {len(data)} bytes, expected at least {_HEADER.size} bytes")
        _, shape, due = _HEADER.unpack_from(data)
        performers = [performer for performer in range(MAX_PERFORMERS) if shape >> performer & 1]
        return cls(due, (shape >> 4) + 1, dict(zip(performers, _split_blocks(data, len(performers)), strict=True)))


@dataclass(frozen=True, slots=True)
class Sample:
    """Pose of a performer at clock time `sampled`.

    `root` is the root's position in metres. `rotations` has a rotation vector for each of the 18 joints, in the frame
    of its parent, as three integers in units of pi/32767.
    """

    TYPE: ClassVar[int] = 72
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B3xIQ3f54h")
    sequence: int
    sampled: int
    root: tuple[float, float, float]
    rotations: tuple[int, ...]

    def pack(self) -> bytes:
        """Encode the message: 136 bytes."""
        return self.LAYOUT.pack(self.TYPE, self.sequence & 0xFFFFFFFF, self.sampled, *self.root, *self.rotations)

    @classmethod
    def unpack(cls, data: bytes) -> Sample:
        """Decode a message; raises `MalformedMessage`, also for a position beyond `MAX_ROOT_M`."""
        if len(data) != cls.LAYOUT.size:
            raise MalformedMessage(f"Sample has {len(data)} bytes, expected {cls.LAYOUT.size} bytes")
        _, sequence, sampled, x, y, z, *rotations = cls.LAYOUT.unpack(data)
        # not finite numbers are not within the bound either
        if not all(abs(coordinate) <= MAX_ROOT_M for coordinate in (x, y, z)):
            raise MalformedMessage(f"Sample has a root position that is not within {MAX_ROOT_M:g} m")
        return cls(sequence, sampled, (x, y, z), tuple(rotations))


def _split_blocks(data: bytes, count: int) -> Iterator[LiveBlock]:
    at = _HEADER.size
    for _ in range(count):
        age = data[at] if at < len(data) else 0
        at += 1
        size, used = 0, 0
        while used < 2 and at + used < len(data):
            size |= (data[at + used] & 127) << 7 * used
            used += 1
            if data[at + used - 1] < 128:
                break
        else:
            raise MalformedMessage("Live ends within its header, or a block's size has more than 2 bytes")
        at += used
        if at + size > len(data):
            raise MalformedMessage(f"Live has a block of {size} bytes, of which {len(data) - at} are there")
        yield LiveBlock(age * AGE_UNIT_US, data[at : at + size])
        at += size
    if at != len(data):
        raise MalformedMessage(f"Live has {len(data) - at} bytes after its last block")
