"""Log of the commands of a stage, which replays to the same overlays.

The log lists the commands that the marionettes received, in order and with their clock times: claims, inputs, frames
and so on. `Marionettes` that receive the same commands return the same overlays to the last bit. The log is bounded: it
consists of segments, each from one rest of all limbs to the next, and the oldest segments are dropped.

As bytes: "bunraku.log/2", then a msgpack map, in which `passages` holds the segments with their commands as fixed
records (`_RECORDS`).
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any, Self

import msgpack

from bunraku.marionette.marionettes import Marionettes, OverlayJoints
from bunraku.marionette.ownership import INITIAL_EPOCHS, LimbInput, Ownership
from bunraku.marionette.recorder import CommandKind
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.messages import TimelineState, unpack

MAGIC = b"bunraku.log/2"
MAX_LOG_BYTES = 8 << 20
"""Size of the records: some hours of one controlled limb."""
MAX_TIMELINES = 10_000

PoseLookup = Callable[[int], Sequence[Array] | None]
"""Returns the rotations (18, 4) of each performer's motion at a clock time in µs, None if there is none."""
FigureLookup = Callable[[str], Sequence[Figure]]
"""Returns the figures of the performers of a motion's id."""

_UNKNOWN_BEGIN_US = 1 << 63
"""Begin of a segment whose first records were dropped: later than all clock times."""

_RECORDS = {
    CommandKind.CLAIM: struct.Struct("<QHB"),
    CommandKind.RELEASE: struct.Struct("<QHBI"),
    CommandKind.LEAVE: struct.Struct("<QH"),
    CommandKind.KEEP_ALIVE: struct.Struct("<QHH"),
    CommandKind.INPUT: struct.Struct("<QHBBIIq3d"),
    CommandKind.ASK: struct.Struct("<QHBB"),
    CommandKind.GRANT_FREE_LIMBS: struct.Struct("<Q"),
    CommandKind.EXPIRE: struct.Struct("<Q"),
    CommandKind.OBSERVE: struct.Struct("<QQ"),
    CommandKind.OVERLAY: struct.Struct("<QQ"),
    CommandKind.FIGURES: struct.Struct("<QH"),
}
"""Fields after the kind: clock time in µs, then the values; texts are indices of names."""


class CorruptInputLog(ValueError):
    """Bytes that are not a valid log."""


@dataclass(slots=True)
class LogSegment:
    """Commands since a rest of all limbs, with the epochs and the motion at its begin."""

    epochs: tuple[int, ...]
    motion_index: int
    begin_us: int
    records: bytearray = field(default_factory=bytearray)


class InputLog:
    """Commands and timelines of a stage. It is the recorder (`CommandRecorder`) of the stage's marionettes."""

    def __init__(self, motion: str = "") -> None:
        """`motion` is the id of the motion at the begin."""
        self._motion = motion
        self.timelines: deque[TimelineState] = deque(maxlen=MAX_TIMELINES)
        self._names: list[str] = []
        self._name_indices: dict[str, int] = {}
        self._segments: deque[LogSegment] = deque()
        self._record_bytes = 0
        self._complete_from_us = 0

    @property
    def motions(self) -> tuple[str, ...]:
        """Ids of the motions of the timelines, in order."""
        return tuple(dict.fromkeys(state.motion for state in self.timelines))

    @property
    def begin_us(self) -> int | None:
        """Begin of the first segment, clock time in µs; None without a segment."""
        return self._segments[0].begin_us if self._segments else None

    @property
    def complete_from_us(self) -> int:
        """Clock time in µs from which all commands are known; 0 if none was dropped."""
        return self._complete_from_us

    def add_timeline(self, state: TimelineState) -> None:
        """Add a timeline of the stage."""
        self.timelines.append(state)

    def change_motion(self, motion: str) -> None:
        """Name the motion of the segments that begin from now on."""
        self._motion = motion

    def begin_segment(self, epochs: tuple[int, ...], now: int) -> None:
        """Begin a segment at clock time `now`, with the epochs of the last grants."""
        self._segments.append(LogSegment(epochs, self._name_index(self._motion), now))

    def append(self, kind: CommandKind, now: int, *values: str | float) -> None:
        """Append a command at clock time `now`; texts among `values` are stored as names."""
        numbers = (self._name_index(value) if isinstance(value, str) else value for value in values)
        record = bytes((kind,)) + _RECORDS[kind].pack(now, *numbers)
        if self._segments[-1].begin_us == _UNKNOWN_BEGIN_US:
            self._complete_from_us = now + 1
        self._segments[-1].records += record
        self._record_bytes += len(record)
        while self._record_bytes > MAX_LOG_BYTES:
            # drop the current segment too if it is the only one: without its begin it replays to nothing
            dropped = self._segments.popleft()
            self._record_bytes -= len(dropped.records)
            if not self._segments:
                self._complete_from_us = now + 1
                self._segments.append(LogSegment(INITIAL_EPOCHS, dropped.motion_index, _UNKNOWN_BEGIN_US))
                break
            self._complete_from_us = max(self._complete_from_us, min(self._segments[0].begin_us, now))

    def pack(self, begin_us: int = 0) -> bytes:
        """Return the log as bytes, without the segments that ended before clock time `begin_us`."""
        kept = list(self._segments_from(begin_us))
        is_whole = len(kept) == len(self._segments)
        segments = [[list(s.epochs), s.motion_index, s.begin_us, s.records] for s in kept]
        timelines = [state.pack() for state in self.timelines]
        values = {
            "names": self._names,
            "timelines": timelines,
            "passages": segments,
            "known_from": self._complete_from_us if is_whole else max(self._complete_from_us, kept[0].begin_us),
        }
        packed: bytes = msgpack.packb(values)
        return MAGIC + packed

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """Parse a log; raises `CorruptInputLog`."""
        if not data.startswith(MAGIC):
            raise CorruptInputLog(f"input log rejected: it does not begin with {MAGIC.decode()}")
        try:
            values = msgpack.unpackb(data[len(MAGIC) :])
            log = cls()
            log._names = [str(name) for name in values["names"]]
            log._name_indices = {name: number for number, name in enumerate(log._names)}
            for state in map(unpack, values["timelines"]):
                if not isinstance(state, TimelineState):
                    raise CorruptInputLog("a message of `timelines` is not a timeline")
                log.timelines.append(state)
            for epochs, motion, begin, records in values["passages"]:
                log._segments.append(LogSegment(tuple(epochs), int(motion), int(begin), bytearray(records)))
            log._complete_from_us = int(values.get("known_from", 0))
        except (ValueError, KeyError, TypeError, msgpack.UnpackException) as error:
            raise CorruptInputLog(f"input log rejected: {error}") from error
        return log

    def replay(
        self, find_figures: FigureLookup, find_poses: PoseLookup, begin_us: int = 0
    ) -> Iterator[tuple[int, OverlayJoints]]:
        """Yield the due time and the overlay of each frame, in order.

        Segments that ended before clock time `begin_us` are left out. Raises `CorruptInputLog`.
        """
        for segment in self._segments_from(begin_us):
            marionettes = Marionettes(find_figures(self._name_at(segment.motion_index)), segment.epochs)
            yield from self._replay_segment(marionettes, segment.records, find_figures, find_poses)

    def _segments_from(self, begin_us: int) -> Iterator[LogSegment]:
        """Yield the segments that had not ended at clock time `begin_us`."""
        segments = tuple(self._segments)
        for segment, following in zip_longest(segments, segments[1:]):
            if following is None or following.begin_us > begin_us:
                yield segment

    def _replay_segment(
        self, marionettes: Marionettes, records: bytearray, find_figures: FigureLookup, find_poses: PoseLookup
    ) -> Iterator[tuple[int, OverlayJoints]]:
        at = 0
        while at < len(records):
            try:
                kind = CommandKind(records[at])
                layout = _RECORDS[kind]
                now, *values = layout.unpack_from(records, at + 1)
            except (ValueError, struct.error) as error:
                raise CorruptInputLog(f"input log rejected: record at byte {at} is cut or of unknown kind") from error
            at += 1 + layout.size
            if kind in (CommandKind.OBSERVE, CommandKind.OVERLAY):
                (due,) = values
                if (poses := find_poses(due)) is None:
                    continue
                if kind is CommandKind.OBSERVE:
                    marionettes.observe_poses(poses, now)
                else:
                    yield due, marionettes.compute_overlay(poses, now)
            elif kind is CommandKind.FIGURES:
                marionettes.set_figures(find_figures(self._name_at(values[0])))
            else:
                self._replay_command(marionettes.ownership, kind, now, values)

    def _replay_command(self, ownership: Ownership, kind: CommandKind, now: int, values: list[Any]) -> None:
        match kind, values:
            case CommandKind.CLAIM, (name, limb):
                ownership.claim(limb, self._name_at(name), now)
            case CommandKind.RELEASE, (name, limb, epoch):
                ownership.release(limb, self._name_at(name), epoch, now)
            case CommandKind.LEAVE, (name,):
                ownership.leave(self._name_at(name), now)
            case CommandKind.KEEP_ALIVE, (name, mask):
                limbs = [limb for limb in range(MAX_LIMBS) if mask >> limb & 1]
                ownership.keep_alive(self._name_at(name), limbs, now)
            case CommandKind.INPUT, (name, limb, input_kind, epoch, sequence, sampled_us, x, y, z):
                limb_input = LimbInput(limb, input_kind, epoch, sequence, sampled_us, (x, y, z))
                ownership.apply_input(self._name_at(name), limb_input, now)
            case CommandKind.ASK, (name, limb, wanted):
                ownership.ask(limb, self._name_at(name), bool(wanted), now)
            case CommandKind.GRANT_FREE_LIMBS, _:
                ownership.grant_free_limbs(now)
            case CommandKind.EXPIRE, _:
                ownership.expire(now)

    def _name_index(self, name: str) -> int:
        if name not in self._name_indices:
            self._name_indices[name] = len(self._names)
            self._names.append(name)
        return self._name_indices[name]

    def _name_at(self, number: int) -> str:
        if number >= len(self._names):
            raise CorruptInputLog(
                f"input log rejected: a record refers to name {number}, but there are {len(self._names)}"
            )
        return self._names[number]
