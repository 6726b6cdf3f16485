"""The messages of `bunraku.v1`: dataclasses to bytes and back (SPEC.md, Sockets).

Names and units are SPEC.md's: times are integer microseconds on the clock or in the motion as each field says. A reader
gets None for a type it does not know, and `MalformedMessage` for one it knows that is broken.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import msgpack
from pydantic import Field, TypeAdapter, ValidationError

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.overlay import Overlay

PROTOCOL_VERSION = 1
SUBPROTOCOL = "bunraku.v1"
CLOCK_NAME = "unix"
MAX_CLIENT_MESSAGE_BYTES = 1_024
MAX_SERVER_MESSAGE_BYTES = 1 << 20
LimbNumber = Annotated[int, Field(strict=True, ge=0, lt=MAX_LIMBS)]
"""Limb l of performer k is 4 k + l."""
SafeInteger = Annotated[int, Field(strict=True, ge=0, lt=1 << 53)]
"""A count or a time: what JavaScript's numbers hold exactly."""


class _MapMessage:
    """A message of one type byte and a MessagePack map of the fields that are not None."""

    TYPE: ClassVar[int]
    __slots__ = ()

    def pack(self) -> bytes:
        """The message as bytes."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}  # type: ignore[attr-defined]
        packed: bytes = msgpack.packb({k: v for k, v in values.items() if v is not None})
        return bytes([self.TYPE]) + packed


@dataclass(frozen=True, slots=True)
class ChannelHeader(_MapMessage):
    """What will come, the first message of a stream (paper 3): `now` clock time, `channels` the total of all tracks."""

    TYPE = 1
    motion: str
    now: SafeInteger
    channels: SafeInteger
    software: str
    version: int = PROTOCOL_VERSION
    clock: str = CLOCK_NAME


@dataclass(frozen=True, slots=True)
class Description(_MapMessage):
    """The type of every track and what its blocks have in common (paper 3); of those from index `first` on, where that
    is not None."""

    TYPE = 2
    motion: str
    tracks: list[dict[str, Any]]
    first: SafeInteger | None = None


@dataclass(frozen=True, slots=True)
class TimelineState(_MapMessage):
    """Where the stage stands: at clock time `clock` at `position` of the motion. Times in microseconds."""

    TYPE = 4
    epoch: SafeInteger
    motion: str
    clock: SafeInteger
    position: SafeInteger
    playing: bool
    loop: bool
    duration: SafeInteger


@dataclass(frozen=True, slots=True)
class Presence(_MapMessage):
    """Who is here and who holds what: `limbs` has the holder's id or None for each of `LIMBS` of each performer, `asks`
    the ids of those who ask for it, first come first."""

    TYPE = 6
    viewers: SafeInteger
    puppeteers: list[dict[str, Any]]
    limbs: list[str | None]
    asks: list[list[str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Left out, nobody asks for any of them."""
        if not self.asks:
            object.__setattr__(self, "asks", [[] for _ in self.limbs])


@dataclass(frozen=True, slots=True)
class Problem(_MapMessage):
    """Why the socket is about to be closed."""

    TYPE = 8
    title: str
    detail: str


@dataclass(frozen=True, slots=True)
class Welcome(_MapMessage):
    """A puppeteer's id, colour (0-4) and the lead of overlays over now, microseconds."""

    TYPE = 9
    id: str
    colour: SafeInteger
    lead: SafeInteger


@dataclass(frozen=True, slots=True)
class Grant(_MapMessage):
    """The limb is yours; inputs carry `epoch`."""

    TYPE = 10
    limb: LimbNumber
    epoch: SafeInteger


@dataclass(frozen=True, slots=True)
class Refusal(_MapMessage):
    """The limb is not, or no longer, yours; `reason` is `held`, `lost` or `unknown`."""

    TYPE = 11
    limb: LimbNumber
    reason: str
    holder: str | None = None


@dataclass(frozen=True, slots=True)
class Notice(_MapMessage):
    """An input was not taken as it came: brought within `reach`, refused for want of an `owner`'s right, or dropped for
    its `rate`; `reason` is one of these three words, `detail` says it to a person."""

    TYPE = 12
    limb: LimbNumber
    reason: str
    detail: str


@dataclass(frozen=True, slots=True)
class Choice(_MapMessage):
    """Which rate the server chose and why: `reason` is one of SPEC.md's words; `line` bit/s that a narrow line carries,
    heads included, left out where it is not narrow."""

    TYPE = 13
    rate: SafeInteger
    reason: str
    line: SafeInteger | None = None


@dataclass(frozen=True, slots=True)
class Edit(_MapMessage):
    """Edits of a viewer's private timeline; None leaves a thing as it is."""

    TYPE = 65
    playing: bool | None = None
    position: SafeInteger | None = None
    loop: bool | None = None


@dataclass(frozen=True, slots=True)
class Report(_MapMessage):
    """How a viewer fares: microseconds ready ahead, to decode a block, to draw a frame; whether its tab is hidden."""

    TYPE = 66
    buffer: SafeInteger
    decode: SafeInteger = 0
    frame: SafeInteger = 0
    hidden: bool = False


@dataclass(frozen=True, slots=True)
class Claim(_MapMessage):
    """Asks for a limb."""

    TYPE = 67
    limb: LimbNumber


@dataclass(frozen=True, slots=True)
class Release(_MapMessage):
    """Lets a limb go."""

    TYPE = 68
    limb: LimbNumber
    epoch: SafeInteger


@dataclass(frozen=True, slots=True)
class Alive(_MapMessage):
    """Still holding `limbs` with nothing new to say."""

    TYPE = 69
    limbs: Annotated[list[LimbNumber], Field(max_length=MAX_LIMBS)] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Ask(_MapMessage):
    """Asks the holder of a limb for it, or no longer."""

    TYPE = 71
    limb: LimbNumber
    wanted: Annotated[bool, Field(strict=True)]


@dataclass(frozen=True, slots=True)
class Data:
    """Block `index` (below 2^21) of one track at one rate."""

    TYPE: ClassVar[int] = 3
    track: int
    rate: int
    index: int
    block: bytes

    def pack(self) -> bytes:
        """The message as bytes: 3 to 5 and the block."""
        low = [self.index >> shift & 127 | 128 for shift in (0, 7) if self.index >> shift + 7]
        return bytes([self.TYPE, self.track << 4 | self.rate, *low, self.index >> 7 * len(low)]) + self.block

    @classmethod
    def unpack(cls, data: bytes) -> Data:
        """The message of `pack`."""
        index, end = 0, 2
        for shift in (0, 7, 14):
            if end < len(data):
                index |= (data[end] & 127) << shift
                end += 1
                if data[end - 1] < 128:
                    return cls(data[1] >> 4, data[1] & 15, index, data[end:])
        raise MalformedMessage("Data has a track and rate, an index of 1 to 3 bytes, and a block")


@dataclass(frozen=True, slots=True)
class Ping:
    """Asks for the time; `sent` is the sender's own clock. As long as its answer, so that both ways cost the same."""

    TYPE: ClassVar[int] = 64
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B3xIQ16x")
    sequence: int
    sent: int

    def pack(self) -> bytes:
        """The message as bytes: 32."""
        return self.LAYOUT.pack(self.TYPE, self.sequence, self.sent)

    @classmethod
    def unpack(cls, data: bytes) -> Ping:
        """The message of `pack`."""
        _, sequence, sent = _unpack_fixed(cls.LAYOUT, data, "Ping")
        return cls(sequence, sent)


@dataclass(frozen=True, slots=True)
class Pong:
    """The answer to a Ping: its `sequence` and `sent`, and the clock times when it came and when this left."""

    TYPE: ClassVar[int] = 7
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B3xIQQQ")
    sequence: int
    sent: int
    received: int
    answered: int

    def pack(self) -> bytes:
        """The message as bytes: 32."""
        return self.LAYOUT.pack(self.TYPE, self.sequence, self.sent, self.received, self.answered)

    @classmethod
    def unpack(cls, data: bytes) -> Pong:
        """The message of `pack`."""
        _, *values = _unpack_fixed(cls.LAYOUT, data, "Pong")
        return cls(*values)


@dataclass(frozen=True, slots=True)
class Input:
    """One sample of the 14 inputs (paper 5): `kind` 0 a velocity of -1..1, 1 a target; `values` as SPEC.md says."""

    TYPE: ClassVar[int] = 70
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<BBBxIIQ3f")
    VELOCITY: ClassVar[int] = 0
    TARGET: ClassVar[int] = 1
    limb: int
    kind: int
    epoch: int
    sequence: int
    sampled: int
    values: tuple[float, float, float]

    def pack(self) -> bytes:
        """The message as bytes: 32."""
        head = (self.TYPE, self.limb, self.kind, self.epoch, self.sequence, self.sampled)
        return self.LAYOUT.pack(*head, *self.values)

    @classmethod
    def unpack(cls, data: bytes) -> Input:
        """The message of `pack`; numbers that are not finite are malformed."""
        _, limb, kind, epoch, sequence, sampled, *values = _unpack_fixed(cls.LAYOUT, data, "Input")
        if limb >= MAX_LIMBS or kind > cls.TARGET:
            raise MalformedMessage(f"Input names limb {limb}, kind {kind}; there are {MAX_LIMBS} limbs and 2 kinds")
        if not all(map(math.isfinite, values)):
            raise MalformedMessage("Input holds a number that is not finite")
        return cls(limb, kind, epoch, sequence, sampled, (values[0], values[1], values[2]))


Message = (
    ChannelHeader | Description | Data | TimelineState | Overlay | Presence | Pong | Problem | Welcome | Grant | Refusal
    | Notice | Choice | Ping | Edit | Report | Claim | Release | Alive | Ask | Input
)  # fmt: skip

_FIXED_MESSAGES = {kind.TYPE: kind for kind in (Data, Overlay, Ping, Pong, Input)} | {
    Overlay.MULTI_PERFORMER_TYPE: Overlay
}
_MAP_ADAPTERS: dict[int, TypeAdapter[Any]] = {
    kind.TYPE: TypeAdapter(kind)
    for kind in (
        ChannelHeader, Description, TimelineState, Presence, Problem, Welcome, Grant, Refusal, Notice, Choice, Edit,
        Report, Claim, Release, Alive, Ask,
    )
}  # fmt: skip


def _unpack_fixed(layout: struct.Struct, data: bytes, name: str) -> tuple[Any, ...]:
    if len(data) != layout.size:
        raise MalformedMessage(f"{name} has {layout.size} bytes, not {len(data)}")
    return layout.unpack(data)


def unpack(data: bytes) -> Message | None:
    """The message in `data`, None where the type is not known here; raises `MalformedMessage`."""
    if not data:
        raise MalformedMessage("an empty message has no type")
    if data[0] in _FIXED_MESSAGES:
        return _FIXED_MESSAGES[data[0]].unpack(data)
    if data[0] not in _MAP_ADAPTERS:
        return None
    try:
        values = msgpack.unpackb(data[1:], strict_map_key=True)
        message: Message = _MAP_ADAPTERS[data[0]].validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "map"
        raise MalformedMessage(f"type {data[0]}, {where}: {first['msg']}") from None
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        raise MalformedMessage(f"type {data[0]} is not a MessagePack map: {error}") from None
    return message
