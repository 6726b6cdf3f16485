"""What was done to the puppets of a stage, so that it can be done again: a session's log replays to the same motion.

The log is a list of what the merge was told, in the order in which it was told it, with the clock times: claims,
inputs, frames asked for, and so on. A `Troupe` told the same gives the same overlays to the last bit. It is
bounded: it is cut into passages, each from a moment when the dance was alone to the next, and the oldest are dropped.

As bytes: "bunraku.log/2", then a msgpack map; `passages` holds the entries as fixed records (`_RECORDS`).
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Self

import msgpack

from bunraku.marionette.marionettes import INITIAL_EPOCHS, Marionettes, OverlayJoints
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput, LimbRefusal
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.messages import TimelineState, unpack

MAGIC = b"bunraku.log/2"
MAX_LOG_BYTES = 8 << 20
"""A log is no larger: some hours of one limb in a hand."""
MAX_TIMELINES = 10_000

PoseLookup = Callable[[int], Sequence[Array] | None]
"""The rotations (18, 4) of each performer's dance at a clock time in µs, None where there is none."""
FigureLookup = Callable[[str], Sequence[Figure]]
"""The figures of the performers of a motion's id."""

_UNKNOWN_BEGIN_US = 1 << 63
"""The beginning of a passage whose own was dropped: later than all clock times."""

_CLAIM, _RELEASE, _LEAVE, _ALIVE, _INPUT, _ASK, _GRANT, _EXPIRE, _OBSERVE, _OVERLAY, _FIGURES = range(11)
_RECORDS = {
    _CLAIM: struct.Struct("<QHB"),
    _RELEASE: struct.Struct("<QHBI"),
    _LEAVE: struct.Struct("<QH"),
    _ALIVE: struct.Struct("<QHH"),
    _INPUT: struct.Struct("<QHBBIIq3d"),
    _ASK: struct.Struct("<QHBB"),
    _GRANT: struct.Struct("<Q"),
    _EXPIRE: struct.Struct("<Q"),
    _OBSERVE: struct.Struct("<QQ"),
    _OVERLAY: struct.Struct("<QQ"),
    _FIGURES: struct.Struct("<QH"),
}


class CorruptInputLog(ValueError):
    """Bytes that are not a log; the text says why."""


@dataclass(slots=True)
class LogSegment:
    """From a moment when the dance was alone: the epochs and the motion at its beginning, and what was done since."""

    epochs: tuple[int, ...]
    motion_index: int
    begin_us: int
    records: bytearray = field(default_factory=bytearray)


class InputLog:
    """What was done to the puppets of a stage, and its timelines."""

    def __init__(self) -> None:
        self.timelines: deque[TimelineState] = deque(maxlen=MAX_TIMELINES)
        self._names: list[str] = []
        self._name_indices: dict[str, int] = {}
        self._segments: deque[LogSegment] = deque()
        self._record_bytes = 0
        self._complete_from_us = 0

    @property
    def motions(self) -> tuple[str, ...]:
        """The ids of the motions it was pulled over, in the order in which they came."""
        return tuple(dict.fromkeys(state.motion for state in self.timelines))

    @property
    def begin_us(self) -> int | None:
        """The clock time, µs, from which it knows all; None where nothing was done."""
        return self._segments[0].begin_us if self._segments else None

    @property
    def complete_from_us(self) -> int:
        """The clock time, µs, from which it knows all that was done; 0 where nothing was dropped yet."""
        return self._complete_from_us

    def add_timeline(self, state: TimelineState) -> None:
        """The stage has a new timeline."""
        self.timelines.append(state)

    def begin_segment(self, epochs: tuple[int, ...], motion: str, now: int) -> None:
        """The dance is alone, and something is about to be done."""
        self._segments.append(LogSegment(epochs, self._name_index(motion), now))

    def append(self, kind: int, now: int, *values: object) -> None:
        """Something was done at clock time `now`; texts among `values` are names."""
        numbers = (self._name_index(value) if isinstance(value, str) else value for value in values)
        record = bytes((kind,)) + _RECORDS[kind].pack(now, *numbers)
        if self._segments[-1].begin_us == _UNKNOWN_BEGIN_US:
            self._complete_from_us = now + 1
        self._segments[-1].records += record
        self._record_bytes += len(record)
        while self._record_bytes > MAX_LOG_BYTES:
            # the passage under way too, if it is the only one: what is half known replays to nothing
            dropped = self._segments.popleft()
            self._record_bytes -= len(dropped.records)
            if not self._segments:
                self._complete_from_us = now + 1
                self._segments.append(LogSegment(INITIAL_EPOCHS, dropped.motion_index, _UNKNOWN_BEGIN_US))
                break
            self._complete_from_us = max(self._complete_from_us, min(self._segments[0].begin_us, now))

    def pack(self) -> bytes:
        """The log as bytes."""
        passages = [[list(p.epochs), p.motion_index, p.begin_us, bytes(p.records)] for p in self._segments]
        timelines = [state.pack() for state in self.timelines]
        values = {
            "names": self._names,
            "timelines": timelines,
            "passages": passages,
            "known_from": self._complete_from_us,
        }
        packed: bytes = msgpack.packb(values)
        return MAGIC + packed

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """The log in `data`; raises `DamagedLog`."""
        if not data.startswith(MAGIC):
            raise CorruptInputLog(f"a log begins with {MAGIC.decode()}")
        try:
            values = msgpack.unpackb(data[len(MAGIC) :])
            log = cls()
            log._names = [str(name) for name in values["names"]]
            log._name_indices = {name: number for number, name in enumerate(log._names)}
            for state in map(unpack, values["timelines"]):
                if not isinstance(state, TimelineState):
                    raise CorruptInputLog("a log's timelines are messages of that kind")
                log.timelines.append(state)
            for epochs, motion, begin, records in values["passages"]:
                log._segments.append(LogSegment(tuple(epochs), int(motion), int(begin), bytearray(records)))
            log._complete_from_us = int(values.get("known_from", 0))
        except (ValueError, KeyError, TypeError, msgpack.UnpackException) as error:
            raise CorruptInputLog(f"a damaged log: {error}") from error
        return log

    def replay(
        self, find_figures: FigureLookup, find_poses: PoseLookup, begin_us: int = 0
    ) -> Iterator[tuple[int, OverlayJoints]]:
        """All frames again, in order: when each was due, and what lay over the dances; passages that were over before
        clock time `begin` are left out. Raises `DamagedLog`."""
        passages = tuple(self._segments)
        for passage, following in zip_longest(passages, passages[1:]):
            if following is not None and following.begin_us <= begin_us:
                continue
            troupe = Marionettes(find_figures(self._name_at(passage.motion_index)), passage.epochs)
            yield from self._replay_segment(troupe, passage.records, find_figures, find_poses)

    def _replay_segment(
        self, marionettes: Marionettes, records: bytearray, find_figures: FigureLookup, find_poses: PoseLookup
    ) -> Iterator[tuple[int, OverlayJoints]]:
        at = 0
        while at < len(records):
            try:
                layout = _RECORDS[records[at]]
                kind, values = records[at], layout.unpack_from(records, at + 1)
            except (KeyError, struct.error) as error:
                raise CorruptInputLog("a log's records are cut or unknown") from error
            at += 1 + layout.size
            now = values[0]
            if kind == _CLAIM:
                marionettes.claim(values[2], self._name_at(values[1]), now)
            elif kind == _RELEASE:
                marionettes.release(values[2], self._name_at(values[1]), values[3], now)
            elif kind == _LEAVE:
                marionettes.leave(self._name_at(values[1]), now)
            elif kind == _ALIVE:
                marionettes.keep_alive(
                    self._name_at(values[1]), [limb for limb in range(MAX_LIMBS) if values[2] >> limb & 1], now
                )
            elif kind == _INPUT:
                _, who, limb, how, epoch, sequence, sampled, *numbers = values
                x, y, z = numbers
                marionettes.apply_input(
                    self._name_at(who), LimbInput(limb, how, epoch, sequence, sampled, (x, y, z)), now
                )
            elif kind == _ASK:
                marionettes.ask(values[2], self._name_at(values[1]), bool(values[3]), now)
            elif kind == _GRANT:
                marionettes.grant_free_limbs(now)
            elif kind == _EXPIRE:
                marionettes.expire(now)
            elif kind == _FIGURES:
                marionettes.set_figures(find_figures(self._name_at(values[1])))
            else:
                poses = find_poses(values[1])
                if poses is None:
                    continue
                if kind == _OBSERVE:
                    marionettes.observe_poses(poses, now)
                else:
                    yield values[1], marionettes.compute_overlay(poses, now)

    def _name_index(self, name: str) -> int:
        if name not in self._name_indices:
            self._name_indices[name] = len(self._names)
            self._names.append(name)
        return self._name_indices[name]

    def _name_at(self, number: int) -> str:
        if number >= len(self._names):
            raise CorruptInputLog("a log names all that it tells of")
        return self._names[number]


class LoggedMarionettes:
    """Puppets that keep a log of what is done to them; each method is `Troupe`'s."""

    def __init__(self, marionettes: Marionettes, motion: str, log: InputLog) -> None:
        """`troupe` is at rest, and of the motion of this id."""
        self.marionettes, self.log = marionettes, log
        self._motion = motion

    def _append(self, kind: int, now: int, *values: object) -> None:
        if self.marionettes.is_at_rest:
            if kind != _CLAIM:
                # at rest nothing else has a consequence
                return
            # as the passage will be replayed
            self.marionettes.reset()
            self.log.begin_segment(self.marionettes.epochs, self._motion, now)
        self.log.append(kind, now, *values)

    def set_figures(self, figures: Sequence[Figure], motion: str, now: int) -> list[tuple[int, str]]:
        """As `Troupe.set_figures`: the performers of the motion of this id."""
        gone = self.marionettes.set_figures(figures)
        self._append(_FIGURES, now, motion)
        self._motion = motion
        return gone

    def claim(self, limb: int, puppeteer: str, now: int) -> LimbGrant | LimbRefusal:
        """As `Troupe.claim`."""
        if 0 <= limb < len(self.marionettes):
            self._append(_CLAIM, now, puppeteer, limb)
        return self.marionettes.claim(limb, puppeteer, now)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """As `Troupe.release`."""
        released = self.marionettes.release(limb, puppeteer, epoch, now)
        if released:
            self._append(_RELEASE, now, puppeteer, limb, epoch)
        return released

    def leave(self, puppeteer: str, now: int) -> None:
        """As `Troupe.leave`."""
        self._append(_LEAVE, now, puppeteer)
        self.marionettes.leave(puppeteer, now)

    def keep_alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """As `Troupe.alive`."""
        held = [limb for limb in limbs if 0 <= limb < len(self.marionettes)]
        self._append(_ALIVE, now, puppeteer, sum(1 << limb for limb in set(held)))
        self.marionettes.keep_alive(puppeteer, held, now)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """As `Troupe.ask`."""
        if not 0 <= limb < len(self.marionettes):
            return False
        self._append(_ASK, now, puppeteer, limb, wanted)
        return self.marionettes.ask(limb, puppeteer, wanted, now)

    def apply_input(self, puppeteer: str, limb_input: LimbInput, now: int) -> InputOutcome:
        """As `Troupe.input`."""
        outcome = self.marionettes.apply_input(puppeteer, limb_input, now)
        if outcome in (InputOutcome.ACCEPTED, InputOutcome.CLAMPED):
            sampled = max(min(limb_input.sampled_us, (1 << 63) - 1), -(1 << 63))
            self._append(
                _INPUT,
                now,
                puppeteer,
                limb_input.limb,
                limb_input.kind,
                limb_input.epoch,
                limb_input.sequence,
                sampled,
                *limb_input.values,
            )
        return outcome

    def grant_free_limbs(self, now: int) -> tuple[list[tuple[str, LimbGrant]], bool]:
        """As `Troupe.settle`."""
        grants, changed = self.marionettes.grant_free_limbs(now)
        if changed:
            self._append(_GRANT, now)
        return grants, changed

    def expire(self, now: int) -> list[tuple[int, str]]:
        """As `Troupe.expire`."""
        lost = self.marionettes.expire(now)
        if lost:
            self._append(_EXPIRE, now)
        return lost

    def observe_poses(self, poses: Sequence[Array], due: int, now: int) -> None:
        """As `Troupe.see`; the poses are the dances' at clock time `due`."""
        self._append(_OBSERVE, now, due)
        self.marionettes.observe_poses(poses, now)

    def compute_overlay(self, poses: Sequence[Array], due: int, now: int) -> OverlayJoints:
        """As `Troupe.overlay`; the poses are the dances' at clock time `due`."""
        self._append(_OVERLAY, now, due)
        return self.marionettes.compute_overlay(poses, now)
