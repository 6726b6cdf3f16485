"""The messages of `bunraku.v1`: dataclasses to bytes and back (proto/messages.md).

Field names and units are those of the contract; a field that is None is left out of the map. The decoder returns None
for an unknown message type and raises `MalformedMessage` for a known type whose content breaks the format.
`proto/asyncapi.json` and the message types of the TypeScript client are generated from these classes by
`python -m tests.vectors`: their docstrings and field descriptions appear there.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import msgpack
from pydantic import Field, TypeAdapter, ValidationError

from bunraku.motion.placement import Placement
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.fields import (
    ClockTime,
    CrowdEntries,
    Duration,
    Flag,
    HandPair,
    LimbEpoch,
    LimbNumber,
    LiveEntries,
    MotionId,
    MotionTime,
    Place,
    PropEntries,
    PropNumber,
    PropPlace,
    PuppeteerEntries,
    SafeInteger,
    Text,
    Tracks,
)
from bunraku.wire.limbs import MAX_BONDS, MAX_LIMBS, MAX_SHOWN_PULLS
from bunraku.wire.live import Live, Sample
from bunraku.wire.overlay import Overlay

PROTOCOL_VERSION = 1
SUBPROTOCOL = "bunraku.v1"
CLOCK_NAME = "unix"
MAX_CLIENT_MESSAGE_BYTES = 1_024
MAX_SERVER_MESSAGE_BYTES = 1 << 20


class _MapMessage:
    """Base of messages that are a type byte and a MessagePack map of the fields that are not None."""

    TYPE: ClassVar[int]
    __slots__ = ()

    def pack(self) -> bytes:
        """Encode the message."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}  # type: ignore[attr-defined]
        packed: bytes = msgpack.packb({k: v for k, v in values.items() if v is not None})
        return bytes([self.TYPE]) + packed


@dataclass(frozen=True, slots=True)
class ChannelHeader(_MapMessage):
    """First message of a stream: version, clock and motion (paper, section 3)."""

    TYPE = 1
    motion: MotionId
    now: ClockTime
    channels: Annotated[SafeInteger, Field(description="Sum of `channels` over all tracks.")]
    software: Annotated[Text, Field(description="Version of the server's software.")]
    version: Annotated[int, Field(description="Version of the contract.")] = PROTOCOL_VERSION
    clock: Annotated[Text, Field(description="Name of the reference clock.")] = CLOCK_NAME


@dataclass(frozen=True, slots=True)
class Description(_MapMessage):
    """Constants of the tracks of a motion, before the first Data message of each (paper, section 3)."""

    TYPE = 2
    motion: MotionId
    tracks: Tracks
    first: Annotated[SafeInteger | None, Field(description="Index of the first of `tracks`; absent: 0.")] = None


@dataclass(frozen=True, slots=True)
class TimelineState(_MapMessage):
    """Timeline of the stage: at clock time `clock` it stands at motion time `position`."""

    TYPE = 4
    epoch: Annotated[SafeInteger, Field(description="A higher epoch replaces a lower one.")]
    motion: MotionId
    clock: ClockTime
    position: MotionTime
    playing: Flag
    loop: Flag
    duration: Duration


@dataclass(frozen=True, slots=True)
class Presence(_MapMessage):
    """Viewers, puppeteers, holders of the limbs, pending requests for held limbs, and live performers.

    `limbs` has an id or None for each limb. `asks` has a list of ids for each limb, in the order of the requests; if it
    is empty it is replaced by an empty list for each limb. `live` is None if no performer is live, `bonds` if no hands
    are bonded, `crowd` if no limb is open to the crowd, `props` if the session has none.
    """

    TYPE = 6
    viewers: SafeInteger
    puppeteers: PuppeteerEntries
    limbs: Annotated[list[Text | None], Field(description="Per limb the id of its holder, or nil.")]
    asks: Annotated[
        list[list[Text]], Field(description="Per limb the ids that request it, oldest first; absent: none.")
    ] = field(default_factory=list)
    live: Annotated[
        LiveEntries | None, Field(description="Live performers of the motion, by number; absent: none.")
    ] = None
    bonds: Annotated[
        list[HandPair] | None,
        Field(min_length=1, max_length=MAX_BONDS, description="Bonded hands; absent: none."),
    ] = None
    crowd: Annotated[
        CrowdEntries | None, Field(description="Limbs that are open to the crowd, by number; absent: none.")
    ] = None
    props: Annotated[PropEntries | None, Field(description="Props of the session, by number; absent: none.")] = None

    def __post_init__(self) -> None:
        if not self.asks:
            object.__setattr__(self, "asks", [[] for _ in self.limbs])
        elif len(self.asks) != len(self.limbs):
            raise ValueError(f"asks has {len(self.asks)} lists, expected one for each of {len(self.limbs)} limbs")


@dataclass(frozen=True, slots=True)
class Problem(_MapMessage):
    """Reason for which the server closes the connection after this message."""

    TYPE = 8
    title: Text
    detail: Text


@dataclass(frozen=True, slots=True)
class Welcome(_MapMessage):
    """Identity of a puppeteer, the first message of a control connection."""

    TYPE = 9
    id: Text
    colour: Annotated[SafeInteger, Field(description="0 to 4, the least used one when the puppeteer joins.")]
    lead: Annotated[SafeInteger, Field(description="Lead of overlays over the current clock time, microseconds.")]


@dataclass(frozen=True, slots=True)
class Grant(_MapMessage):
    """The limb is granted to this puppeteer; inputs for it carry `epoch`."""

    TYPE = 10
    limb: LimbNumber
    epoch: LimbEpoch


@dataclass(frozen=True, slots=True)
class Refusal(_MapMessage):
    """The limb is not, or no longer, this puppeteer's."""

    TYPE = 11
    limb: LimbNumber
    reason: Annotated[Text, Field(description="`held`, `lost` or `unknown`.")]
    holder: Annotated[Text | None, Field(description="Id of the holder, if `reason` is `held`.")] = None


@dataclass(frozen=True, slots=True)
class Notice(_MapMessage):
    """An input was changed or dropped."""

    TYPE = 12
    limb: LimbNumber
    reason: Annotated[Text, Field(description="`reach`, `owner` or `rate`.")]
    detail: Annotated[Text, Field(description="The reason for a person.")]


@dataclass(frozen=True, slots=True)
class BondEnd(_MapMessage):
    """Two hands are not, or no longer, bonded."""

    TYPE = 16
    limbs: HandPair
    reason: Annotated[Text, Field(description="A reason of proto/messages.md, 3.7.")]


@dataclass(frozen=True, slots=True)
class CrowdPulls(_MapMessage):
    """Some of the crowd's pulls of a limb."""

    TYPE = 17
    limb: LimbNumber
    count: Annotated[SafeInteger, Field(description="Number of members who pull.")]
    places: Annotated[list[Place], Field(max_length=MAX_SHOWN_PULLS, description="Targets of some of them.")]
    votes: Annotated[
        list[SafeInteger] | None,
        Field(min_length=1, description="Votes for each gesture of the limb; absent: the policy is not `vote`."),
    ] = None


@dataclass(frozen=True, slots=True)
class CrowdTurn(_MapMessage):
    """Begin or end of this viewer's turn to move a limb that is open to the crowd."""

    TYPE = 19
    limb: LimbNumber
    yours: Annotated[Flag, Field(description="True: the limb follows this viewer's pull.")]


@dataclass(frozen=True, slots=True)
class PropRefusal(_MapMessage):
    """A prop is not put where this puppeteer wanted it."""

    TYPE = 18
    prop: PropNumber
    reason: Annotated[Text, Field(description="A reason of proto/messages.md, 3.7.")]


@dataclass(frozen=True, slots=True)
class Choice(_MapMessage):
    """Bitrate level of the motion that the server has chosen, and the reason."""

    TYPE = 13
    rate: Annotated[SafeInteger, Field(description="Index into `rates` of the motion's track.")]
    reason: Annotated[Text, Field(description="A reason of proto/messages.md, 3.8.")]
    line: Annotated[
        SafeInteger | None, Field(description="Throughput of a constrained link in bit/s, header overhead included.")
    ] = None


@dataclass(frozen=True, slots=True)
class Edit(_MapMessage):
    """Edit of a viewer's private timeline; an absent field leaves its value unchanged."""

    TYPE = 65
    playing: Flag | None = None
    position: MotionTime | None = None
    loop: Flag | None = None


@dataclass(frozen=True, slots=True)
class Report(_MapMessage):
    """Playback statistics of a viewer."""

    TYPE = 66
    buffer: Annotated[SafeInteger, Field(description="Microseconds of motion ready ahead of the play position.")]
    decode: Annotated[SafeInteger, Field(description="Microseconds to decode a block.")] = 0
    frame: Annotated[SafeInteger, Field(description="Microseconds to draw a frame.")] = 0
    hidden: Annotated[Flag, Field(description="True while the page is in the background.")] = False


@dataclass(frozen=True, slots=True)
class Claim(_MapMessage):
    """Request for a free limb."""

    TYPE = 67
    limb: LimbNumber


@dataclass(frozen=True, slots=True)
class Release(_MapMessage):
    """Release of a held limb."""

    TYPE = 68
    limb: LimbNumber
    epoch: LimbEpoch


@dataclass(frozen=True, slots=True)
class Alive(_MapMessage):
    """Heartbeat for limbs that are held without a new input."""

    TYPE = 69
    limbs: Annotated[list[LimbNumber], Field(max_length=MAX_LIMBS)] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Ask(_MapMessage):
    """Request for a limb that another puppeteer holds, or the end of that request."""

    TYPE = 71
    limb: LimbNumber
    wanted: Flag


@dataclass(frozen=True, slots=True)
class Bond(_MapMessage):
    """Request to bond two hands, or to end their bond."""

    TYPE = 73
    limbs: HandPair
    wanted: Flag


@dataclass(frozen=True, slots=True)
class Pull(_MapMessage):
    """Pull of a viewer on a limb that is open to the crowd."""

    TYPE = 74
    limb: LimbNumber
    place: Place


@dataclass(frozen=True, slots=True)
class Put(_MapMessage):
    """Request to put a prop into a hand, or to lay it down at a place."""

    TYPE = 75
    prop: PropNumber
    limb: LimbNumber | None = None
    place: PropPlace | None = None

    def __post_init__(self) -> None:
        if (self.limb is None) == (self.place is None):
            raise ValueError("expected either limb or place")
        if self.place is not None:
            Placement.parse(self.place)


@dataclass(frozen=True, slots=True)
class Data:
    """One block: block `index` (below 2^21) of a track at one bitrate level."""

    TYPE: ClassVar[int] = 3
    track: int
    rate: int
    index: int
    block: bytes

    def pack(self) -> bytes:
        """Encode the message: 3 to 5 bytes and the block."""
        low = [self.index >> shift & 127 | 128 for shift in (0, 7) if self.index >> shift + 7]
        return bytes([self.TYPE, self.track << 4 | self.rate, *low, self.index >> 7 * len(low)]) + self.block

    @classmethod
    def unpack(cls, data: bytes) -> Data:
        """Decode a message; raises `MalformedMessage`."""
        index, end = 0, 2
        for shift in (0, 7, 14):
            if end < len(data):
                index |= (data[end] & 127) << shift
                end += 1
                if data[end - 1] < 128:
                    return cls(data[1] >> 4, data[1] & 15, index, data[end:])
        raise MalformedMessage("Data ends within its header, or its index has more than 3 bytes")


@dataclass(frozen=True, slots=True)
class Ping:
    """Clock request. It has the size of the answer, so that both directions take equally long to transmit."""

    TYPE: ClassVar[int] = 64
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B3xIQ16x")
    sequence: int
    sent: int

    def pack(self) -> bytes:
        """Encode the message: 32 bytes."""
        return self.LAYOUT.pack(self.TYPE, self.sequence, self.sent)

    @classmethod
    def unpack(cls, data: bytes) -> Ping:
        """Decode a message; raises `MalformedMessage`."""
        _, sequence, sent = _unpack_fixed(cls.LAYOUT, data, "Ping")
        return cls(sequence, sent)


@dataclass(frozen=True, slots=True)
class Pong:
    """Answer to a Ping: its `sequence` and `sent`, and the clock times of its arrival and of this answer."""

    TYPE: ClassVar[int] = 7
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<B3xIQQQ")
    sequence: int
    sent: int
    received: int
    answered: int

    def pack(self) -> bytes:
        """Encode the message: 32 bytes."""
        return self.LAYOUT.pack(self.TYPE, self.sequence, self.sent, self.received, self.answered)

    @classmethod
    def unpack(cls, data: bytes) -> Pong:
        """Decode a message; raises `MalformedMessage`."""
        _, *values = _unpack_fixed(cls.LAYOUT, data, "Pong")
        return cls(*values)


@dataclass(frozen=True, slots=True)
class Input:
    """One sample of a limb's inputs (paper, section 5): a velocity (`kind` 0) or a target (`kind` 1)."""

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
        """Encode the message: 32 bytes."""
        head = (self.TYPE, self.limb, self.kind, self.epoch, self.sequence, self.sampled)
        return self.LAYOUT.pack(*head, *self.values)

    @classmethod
    def unpack(cls, data: bytes) -> Input:
        """Decode a message; raises `MalformedMessage`, also for a value that is not finite."""
        _, limb, kind, epoch, sequence, sampled, *values = _unpack_fixed(cls.LAYOUT, data, "Input")
        if limb >= MAX_LIMBS or kind > cls.TARGET:
            raise MalformedMessage(
                f"Input has limb {limb} and kind {kind}, expected a limb of 0..{MAX_LIMBS - 1} and kind 0 or 1"
            )
        if not all(map(math.isfinite, values)):
            raise MalformedMessage("Input has a value that is not finite")
        return cls(limb, kind, epoch, sequence, sampled, (values[0], values[1], values[2]))


Message = (
    ChannelHeader | Description | Data | TimelineState | Overlay | Presence | Pong | Problem | Welcome | Grant
    | Refusal | Notice | BondEnd | CrowdPulls | PropRefusal | CrowdTurn | Choice | Live | Ping | Edit | Report | Claim
    | Release | Alive | Ask | Bond | Pull | Put | Input | Sample
)  # fmt: skip

FIXED_MESSAGES = (Data, Overlay, Live, Ping, Pong, Input, Sample)
"""Messages of fixed layout."""
MAP_MESSAGES = (
    ChannelHeader, Description, TimelineState, Presence, Problem, Welcome, Grant, Refusal, Notice, BondEnd,
    CrowdPulls, PropRefusal, CrowdTurn, Choice, Edit, Report, Claim, Release, Alive, Ask, Bond, Pull, Put,
)  # fmt: skip
"""Messages that are a MessagePack map."""

_FIXED_BY_TYPE = {kind.TYPE: kind for kind in FIXED_MESSAGES} | {Overlay.MULTI_PERFORMER_TYPE: Overlay}
_MAP_ADAPTERS: dict[int, TypeAdapter[Any]] = {kind.TYPE: TypeAdapter(kind) for kind in MAP_MESSAGES}


def _unpack_fixed(layout: struct.Struct, data: bytes, name: str) -> tuple[Any, ...]:
    if len(data) != layout.size:
        raise MalformedMessage(f"{name} has {len(data)} bytes, expected {layout.size} bytes")
    return layout.unpack(data)


def unpack(data: bytes) -> Message | None:
    """Decode a message, or return None if its type is unknown; raises `MalformedMessage`."""
    if not data:
        raise MalformedMessage("message is empty, expected a type byte")
    if data[0] in _FIXED_BY_TYPE:
        return _FIXED_BY_TYPE[data[0]].unpack(data)
    if data[0] not in _MAP_ADAPTERS:
        return None
    try:
        values = msgpack.unpackb(data[1:], strict_map_key=True)
        message: Message = _MAP_ADAPTERS[data[0]].validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "map"
        raise MalformedMessage(f"message of type {data[0]}, field {where}: {first['msg']}") from None
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        raise MalformedMessage(f"message of type {data[0]} is not a MessagePack map: {error}") from None
    return message
