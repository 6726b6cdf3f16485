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

from bunraku.marionette.ownership import Grant, Input, Outcome, Refusal
from bunraku.marionette.troupe import NEW, Laid, Troupe
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.wire.limbs import MOST_LIMBS
from bunraku.wire.messages import TimelineState, unpack

MAGIC = b"bunraku.log/2"
MOST_BYTES = 8 << 20
"""A log is no larger: some hours of one limb in a hand."""
MOST_TIMELINES = 10_000

PosesAt = Callable[[int], Sequence[Array] | None]
"""The rotations (18, 4) of each performer's dance at a clock time in µs, None where there is none."""
FiguresOf = Callable[[str], Sequence[Figure]]
"""The figures of the performers of a motion's id."""

_UNKNOWN = 1 << 63
"""The beginning of a passage whose own was dropped: later than all clock times."""

_CLAIM, _RELEASE, _LEAVE, _ALIVE, _INPUT, _ASK, _SETTLE, _EXPIRE, _SEE, _OVERLAY, _DANCE = range(11)
_RECORDS = {
    _CLAIM: struct.Struct("<QHB"),
    _RELEASE: struct.Struct("<QHBI"),
    _LEAVE: struct.Struct("<QH"),
    _ALIVE: struct.Struct("<QHH"),
    _INPUT: struct.Struct("<QHBBIIq3d"),
    _ASK: struct.Struct("<QHBB"),
    _SETTLE: struct.Struct("<Q"),
    _EXPIRE: struct.Struct("<Q"),
    _SEE: struct.Struct("<QQ"),
    _OVERLAY: struct.Struct("<QQ"),
    _DANCE: struct.Struct("<QH"),
}


class DamagedLog(ValueError):
    """Bytes that are not a log; the text says why."""


@dataclass(slots=True)
class Passage:
    """From a moment when the dance was alone: the epochs and the motion at its beginning, and what was done since."""

    epochs: tuple[int, ...]
    motion: int
    begin: int
    records: bytearray = field(default_factory=bytearray)


class Log:
    """What was done to the puppets of a stage, and its timelines."""

    def __init__(self) -> None:
        self.timelines: deque[TimelineState] = deque(maxlen=MOST_TIMELINES)
        self._names: list[str] = []
        self._numbers: dict[str, int] = {}
        self._passages: deque[Passage] = deque()
        self._size = 0
        self._known_from = 0

    @property
    def motions(self) -> tuple[str, ...]:
        """The ids of the motions it was pulled over, in the order in which they came."""
        return tuple(dict.fromkeys(state.motion for state in self.timelines))

    @property
    def begin(self) -> int | None:
        """The clock time, µs, from which it knows all; None where nothing was done."""
        return self._passages[0].begin if self._passages else None

    @property
    def known_from(self) -> int:
        """The clock time, µs, from which it knows all that was done; 0 where nothing was dropped yet."""
        return self._known_from

    def timeline(self, state: TimelineState) -> None:
        """The stage has a new timeline."""
        self.timelines.append(state)

    def open(self, epochs: tuple[int, ...], motion: str, now: int) -> None:
        """The dance is alone, and something is about to be done."""
        self._passages.append(Passage(epochs, self._number(motion), now))

    def note(self, kind: int, now: int, *values: object) -> None:
        """Something was done at clock time `now`; texts among `values` are names."""
        numbers = (self._number(value) if isinstance(value, str) else value for value in values)
        record = bytes((kind,)) + _RECORDS[kind].pack(now, *numbers)
        if self._passages[-1].begin == _UNKNOWN:
            self._known_from = now + 1
        self._passages[-1].records += record
        self._size += len(record)
        while self._size > MOST_BYTES:
            # the passage under way too, if it is the only one: what is half known replays to nothing
            dropped = self._passages.popleft()
            self._size -= len(dropped.records)
            if not self._passages:
                self._known_from = now + 1
                self._passages.append(Passage(NEW, dropped.motion, _UNKNOWN))
                break
            self._known_from = max(self._known_from, min(self._passages[0].begin, now))

    def pack(self) -> bytes:
        """The log as bytes."""
        passages = [[list(p.epochs), p.motion, p.begin, bytes(p.records)] for p in self._passages]
        timelines = [state.pack() for state in self.timelines]
        values = {"names": self._names, "timelines": timelines, "passages": passages, "known_from": self._known_from}
        packed: bytes = msgpack.packb(values)
        return MAGIC + packed

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """The log in `data`; raises `DamagedLog`."""
        if not data.startswith(MAGIC):
            raise DamagedLog(f"a log begins with {MAGIC.decode()}")
        try:
            values = msgpack.unpackb(data[len(MAGIC) :])
            log = cls()
            log._names = [str(name) for name in values["names"]]
            log._numbers = {name: number for number, name in enumerate(log._names)}
            for state in map(unpack, values["timelines"]):
                if not isinstance(state, TimelineState):
                    raise DamagedLog("a log's timelines are messages of that kind")
                log.timelines.append(state)
            for epochs, motion, begin, records in values["passages"]:
                log._passages.append(Passage(tuple(epochs), int(motion), int(begin), bytearray(records)))
            log._known_from = int(values.get("known_from", 0))
        except (ValueError, KeyError, TypeError, msgpack.UnpackException) as error:
            raise DamagedLog(f"a damaged log: {error}") from error
        return log

    def replay(self, figures_of: FiguresOf, poses_at: PosesAt, begin: int = 0) -> Iterator[tuple[int, Laid]]:
        """All frames again, in order: when each was due, and what lay over the dances; passages that were over before
        clock time `begin` are left out. Raises `DamagedLog`."""
        passages = tuple(self._passages)
        for passage, following in zip_longest(passages, passages[1:]):
            if following is not None and following.begin <= begin:
                continue
            troupe = Troupe(figures_of(self._name(passage.motion)), passage.epochs)
            yield from self._play(troupe, passage.records, figures_of, poses_at)

    def _play(
        self, troupe: Troupe, records: bytearray, figures_of: FiguresOf, poses_at: PosesAt
    ) -> Iterator[tuple[int, Laid]]:
        at = 0
        while at < len(records):
            try:
                layout = _RECORDS[records[at]]
                kind, values = records[at], layout.unpack_from(records, at + 1)
            except (KeyError, struct.error) as error:
                raise DamagedLog("a log's records are cut or unknown") from error
            at += 1 + layout.size
            now = values[0]
            if kind == _CLAIM:
                troupe.claim(values[2], self._name(values[1]), now)
            elif kind == _RELEASE:
                troupe.release(values[2], self._name(values[1]), values[3], now)
            elif kind == _LEAVE:
                troupe.leave(self._name(values[1]), now)
            elif kind == _ALIVE:
                troupe.alive(self._name(values[1]), [limb for limb in range(MOST_LIMBS) if values[2] >> limb & 1], now)
            elif kind == _INPUT:
                _, who, limb, how, epoch, sequence, sampled, *numbers = values
                x, y, z = numbers
                troupe.input(self._name(who), Input(limb, how, epoch, sequence, sampled, (x, y, z)), now)
            elif kind == _ASK:
                troupe.ask(values[2], self._name(values[1]), bool(values[3]), now)
            elif kind == _SETTLE:
                troupe.settle(now)
            elif kind == _EXPIRE:
                troupe.expire(now)
            elif kind == _DANCE:
                troupe.set_figures(figures_of(self._name(values[1])))
            else:
                poses = poses_at(values[1])
                if poses is None:
                    continue
                if kind == _SEE:
                    troupe.see(poses, now)
                else:
                    yield values[1], troupe.overlay(poses, now)

    def _number(self, name: str) -> int:
        if name not in self._numbers:
            self._numbers[name] = len(self._names)
            self._names.append(name)
        return self._numbers[name]

    def _name(self, number: int) -> str:
        if number >= len(self._names):
            raise DamagedLog("a log names all that it tells of")
        return self._names[number]


class LoggedTroupe:
    """Puppets that keep a log of what is done to them; each method is `Troupe`'s."""

    def __init__(self, troupe: Troupe, motion: str, log: Log) -> None:
        """`troupe` is at rest, and of the motion of this id."""
        self.troupe, self.log = troupe, log
        self._motion = motion

    def _note(self, kind: int, now: int, *values: object) -> None:
        if self.troupe.at_rest:
            if kind != _CLAIM:
                # at rest nothing else has a consequence
                return
            # as the passage will be replayed
            self.troupe.begin_anew()
            self.log.open(self.troupe.epochs, self._motion, now)
        self.log.note(kind, now, *values)

    def set_figures(self, figures: Sequence[Figure], motion: str, now: int) -> list[tuple[int, str]]:
        """As `Troupe.set_figures`: the performers of the motion of this id."""
        gone = self.troupe.set_figures(figures)
        self._note(_DANCE, now, motion)
        self._motion = motion
        return gone

    def claim(self, limb: int, puppeteer: str, now: int) -> Grant | Refusal:
        """As `Troupe.claim`."""
        if 0 <= limb < len(self.troupe):
            self._note(_CLAIM, now, puppeteer, limb)
        return self.troupe.claim(limb, puppeteer, now)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """As `Troupe.release`."""
        released = self.troupe.release(limb, puppeteer, epoch, now)
        if released:
            self._note(_RELEASE, now, puppeteer, limb, epoch)
        return released

    def leave(self, puppeteer: str, now: int) -> None:
        """As `Troupe.leave`."""
        self._note(_LEAVE, now, puppeteer)
        self.troupe.leave(puppeteer, now)

    def alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """As `Troupe.alive`."""
        held = [limb for limb in limbs if 0 <= limb < len(self.troupe)]
        self._note(_ALIVE, now, puppeteer, sum(1 << limb for limb in set(held)))
        self.troupe.alive(puppeteer, held, now)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """As `Troupe.ask`."""
        if not 0 <= limb < len(self.troupe):
            return False
        self._note(_ASK, now, puppeteer, limb, wanted)
        return self.troupe.ask(limb, puppeteer, wanted, now)

    def input(self, puppeteer: str, given: Input, now: int) -> Outcome:
        """As `Troupe.input`."""
        outcome = self.troupe.input(puppeteer, given, now)
        if outcome in (Outcome.TAKEN, Outcome.REACH):
            sampled = max(min(given.sampled, (1 << 63) - 1), -(1 << 63))
            self._note(
                _INPUT, now, puppeteer, given.limb, given.kind, given.epoch, given.sequence, sampled, *given.values
            )
        return outcome

    def settle(self, now: int) -> tuple[list[tuple[str, Grant]], bool]:
        """As `Troupe.settle`."""
        grants, changed = self.troupe.settle(now)
        if changed:
            self._note(_SETTLE, now)
        return grants, changed

    def expire(self, now: int) -> list[tuple[int, str]]:
        """As `Troupe.expire`."""
        lost = self.troupe.expire(now)
        if lost:
            self._note(_EXPIRE, now)
        return lost

    def see(self, poses: Sequence[Array], due: int, now: int) -> None:
        """As `Troupe.see`; the poses are the dances' at clock time `due`."""
        self._note(_SEE, now, due)
        self.troupe.see(poses, now)

    def overlay(self, poses: Sequence[Array], due: int, now: int) -> Laid:
        """As `Troupe.overlay`; the poses are the dances' at clock time `due`."""
        self._note(_OVERLAY, now, due)
        return self.troupe.overlay(poses, now)
