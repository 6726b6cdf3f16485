"""Log of what the viewers of a session saw: its timelines, the overlays of its limbs, the poses of live performers and
the props.

Overlays and poses are the messages that the stage published, so a replay gives the poses of the viewers to the last
bit. The log covers the last `LOG_DURATION_US`, the longest recording with a margin; what is older is dropped.

As bytes: "bunraku.log/3", then a msgpack map with `timelines`, a list of messages, `overlays`, Overlay and Live
messages with their lengths (u16) before them, and, if there are any, `props`, a list of [clock time, props by number].
"""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from operator import itemgetter
from typing import Any, Self

import msgpack

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.live import Live
from bunraku.wire.messages import TimelineState, unpack
from bunraku.wire.overlay import Overlay
from bunraku.wire.prop import Prop

MAGIC = b"bunraku.log/3"
LOG_DURATION_US = 660_000_000
CHUNK_DURATION_US = 10_000_000
"""Messages are dropped in chunks of this duration."""
MAX_LOG_BYTES = 20 << 20
"""Bound of the messages: in `LOG_DURATION_US`, sixteen controlled limbs at the full frame rate have 12 MB, four live
performers 7 MB."""
MAX_TIMELINES = 10_000
MAX_PROP_CHANGES = 14_000
"""Bound of the changes of props: twenty per second in `LOG_DURATION_US`."""

_LENGTH = struct.Struct("<H")


class CorruptSessionLog(ValueError):
    """Bytes that are not a valid log."""


@dataclass(slots=True)
class _Chunk:
    """Messages of some seconds, the first of which is due at `begin_us`."""

    begin_us: int
    end_us: int
    messages: bytearray = field(default_factory=bytearray)


class SessionLog:
    """Timelines and messages of a session; times are clock times in microseconds."""

    def __init__(self) -> None:
        self.timelines: deque[TimelineState] = deque(maxlen=MAX_TIMELINES)
        self._props: deque[tuple[int, dict[int, Prop]]] = deque([(0, {})], maxlen=MAX_PROP_CHANGES)
        self._chunks: deque[_Chunk] = deque()
        self._message_bytes = 0

    @property
    def motions(self) -> tuple[str, ...]:
        """Ids of the motions of the timelines, in order."""
        return tuple(dict.fromkeys(state.motion for state in self.timelines))

    def add_timeline(self, state: TimelineState) -> None:
        """Add a timeline of the session."""
        self.timelines.append(state)
        self._drop_before(state.clock - LOG_DURATION_US)

    def add_props(self, clock: int, props: dict[int, Prop]) -> None:
        """Add the props from a clock time on, by number; times ascend."""
        if props != self._props[-1][1]:
            self._props.append((clock, props))
            self._drop_before(clock - LOG_DURATION_US)

    def props_at(self, clock: int) -> dict[int, Prop]:
        """Return the props at a clock time, by number."""
        return self._props[self._props_index(clock)][1]

    def _props_index(self, clock: int) -> int:
        return max(bisect_right(self._props, clock, key=itemgetter(0)) - 1, 0)

    def add_message(self, due_us: int, message: bytes) -> None:
        """Add a published Overlay or Live message, whose last frame is due at `due_us`; due times ascend."""
        if not self._chunks or due_us - self._chunks[-1].begin_us >= CHUNK_DURATION_US:
            self._chunks.append(_Chunk(due_us, due_us))
            self._drop_before(due_us - LOG_DURATION_US)
        chunk = self._chunks[-1]
        chunk.end_us = due_us
        chunk.messages += _LENGTH.pack(len(message)) + message
        self._message_bytes += _LENGTH.size + len(message)
        while self._message_bytes > MAX_LOG_BYTES:
            self._drop_chunk()

    def messages(self, begin_us: int = 0) -> Iterator[Overlay | Live]:
        """Yield the messages in order, without those of chunks that end before `begin_us`.

        Raises `CorruptSessionLog`.
        """
        for chunk in self._chunks:
            if chunk.end_us >= begin_us:
                yield from _unpack_messages(chunk.messages)

    def pack(self, begin_us: int = 0) -> bytes:
        """Return the log as bytes, without what viewers saw before `begin_us`."""
        states = list(self.timelines)
        first = max((index for index, state in enumerate(states) if state.clock <= begin_us), default=0)
        values: dict[str, Any] = {
            "timelines": [state.pack() for state in states[first:]],
            "overlays": b"".join(chunk.messages for chunk in self._chunks if chunk.end_us >= begin_us),
        }
        if len(self._props) > 1 or self._props[0][1]:
            values["props"] = [
                [clock, [[number, prop.to_values()] for number, prop in props.items()]]
                for clock, props in islice(self._props, self._props_index(begin_us), None)
            ]
        packed: bytes = msgpack.packb(values)
        return MAGIC + packed

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """Parse a log; raises `CorruptSessionLog`. Its messages are parsed by `messages`."""
        if not data.startswith(MAGIC):
            raise CorruptSessionLog(f"session log rejected: it does not begin with {MAGIC.decode()}")
        log = cls()
        try:
            values = msgpack.unpackb(data[len(MAGIC) :])
            for state in map(unpack, values["timelines"]):
                if not isinstance(state, TimelineState):
                    raise CorruptSessionLog("session log rejected: a message of `timelines` is not a timeline")
                log.timelines.append(state)
            log._chunks.append(_Chunk(0, 1 << 63, bytearray(values["overlays"])))
            for clock, props in values.get("props", []):
                if not isinstance(clock, int):
                    raise CorruptSessionLog("session log rejected: the time of a change of props is not an integer")
                log.add_props(clock, {number: Prop.from_values(prop) for number, prop in props})
        except (ValueError, KeyError, TypeError, msgpack.UnpackException) as error:
            raise CorruptSessionLog(f"session log rejected: {error}") from error
        return log

    def _drop_before(self, begin_us: int) -> None:
        """Drop the chunks and timelines that had ended at `begin_us`."""
        while self._chunks and self._chunks[0].end_us < begin_us:
            self._drop_chunk()
        while len(self.timelines) > 1 and self.timelines[1].clock <= begin_us:
            self.timelines.popleft()
        while len(self._props) > 1 and self._props[1][0] <= begin_us:
            self._props.popleft()

    def _drop_chunk(self) -> None:
        self._message_bytes -= len(self._chunks.popleft().messages)


def _unpack_messages(messages: bytes | bytearray) -> Iterator[Overlay | Live]:
    at, end = 0, len(messages)
    while at < end:
        try:
            (length,) = _LENGTH.unpack_from(messages, at)
            message = unpack(bytes(messages[at + _LENGTH.size : at + _LENGTH.size + length]))
        except (struct.error, MalformedMessage) as error:
            raise CorruptSessionLog(f"session log rejected: message at byte {at}: {error}") from error
        if not isinstance(message, Overlay | Live):
            raise CorruptSessionLog(
                f"session log rejected: the message at byte {at} shows neither limbs nor performers"
            )
        yield message
        at += _LENGTH.size + length
