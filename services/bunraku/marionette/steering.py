"""What a puppeteer's inputs say: where the limb should be.

The value is a hand target (arm lengths, in the shoulder's frame) or the thigh's angle (radians, first of the three). A
target is gone to evenly, in the time between the last two inputs, so that a stream of them is a line and not a stair; a
velocity moves the value until the next input. Inputs count in the order of their sequence numbers, whatever order they
come in: a late one is put where it belongs, and the value is what it would be had it come in time.

When an input was made is told from the sender's clock, but only against the sender's other inputs: the quickest of them
is taken to have needed no time. So a clock that is an hour off changes nothing. Times are clock time in µs.
"""

from __future__ import annotations

from bisect import bisect_left
from enum import IntEnum
from math import isfinite
from typing import NamedTuple

from bunraku.marionette import vector
from bunraku.marionette.leg import clamp_thigh
from bunraku.marionette.vector import Vector

HAND_SPEED = 1.0
"""Arm lengths per second at full speed along one axis."""
LEG_SPEED = 2.0
"""Radians per second at full speed."""
HOLD_AFTER = 250_000
"""Without a word from the puppeteer for this many µs the limb holds still. An input counts as made no earlier than this
before it came."""
LONGEST_WAY = 33_000
"""A target is gone to in this many µs at most."""
KEPT = 64
"""Inputs that a late one may come after."""

STILL: Vector = (0.0, 0.0, 0.0)


class Kind(IntEnum):
    """What the three numbers of an input are; the numbers are the contract's."""

    VELOCITY = 0
    TARGET = 1


class _Sample(NamedTuple):
    sequence: int
    at: int
    kind: Kind
    values: Vector


class _Leg(NamedTuple):
    """From one input to the next: `start` at `at`, then towards `goal` in `way` µs, or on at `speed` a second."""

    at: int
    start: Vector | None
    goal: Vector | None
    way: int
    speed: Vector


class Steering:
    """One limb in one puppeteer's hands. `value` is None until an input or `begin` says where the limb is.

    It keeps its own time in µs: since it was made, less what its puppeteer was silent for beyond `HOLD_AFTER`.
    """

    def __init__(self, is_hand: bool, now: int) -> None:
        self._is_hand = is_hand
        self._heard = now
        self._passed = 0
        self._quickest: int | None = None
        self._folded = -1
        self._samples: list[_Sample] = []
        self._legs = [_Leg(0, None, None, 0, STILL)]

    @property
    def heard(self) -> int:
        """When the puppeteer last said anything about this limb."""
        return self._heard

    def value(self, now: int) -> Vector | None:
        """Where the limb should be at `now`."""
        leg = self._legs[-1]
        return self._along(leg, max(self._time(now), leg.at))

    def begin(self, value: Vector) -> None:
        """Says where the limb was when it was taken, unless that was said before."""
        first = self._legs[0]
        if first.start is None:
            self._legs[0] = first._replace(start=value)
            self._recount(0)

    def hear(self, now: int) -> None:
        """The puppeteer is there; a limb that held still moves on from now."""
        self._passed = self._time(now)
        self._heard = max(self._heard, now)

    def input(self, kind: Kind, values: Vector, sequence: int, sampled: int, now: int) -> bool:
        """Takes an input in; whether it asked for a place within reach.

        Raises `ValueError` if a number is not finite, `Late` for a sequence that came before, or comes after `KEPT`
        newer.
        """
        if not all(isfinite(part) for part in values):
            raise ValueError(f"an input's numbers must be finite, not {values}")
        at = bisect_left(self._samples, sequence, key=lambda sample: sample.sequence)
        if sequence <= self._folded or (at < len(self._samples) and self._samples[at].sequence == sequence):
            raise Late
        self.hear(now)
        lag = now - sampled
        self._quickest = lag if self._quickest is None else min(self._quickest, lag)
        made = self._passed - min(lag - self._quickest, HOLD_AFTER)
        within = self._speed(values) if kind is Kind.VELOCITY else within_reach(self._is_hand, values)
        self._samples.insert(at, _Sample(sequence, max(made, 0), kind, within))
        self._recount(at)
        if len(self._samples) > KEPT:
            self._folded = self._samples.pop(0).sequence
            self._legs.pop(0)
        return kind is Kind.VELOCITY or (within[0] == values[0] and (not self._is_hand or within == values))

    def stop(self, now: int) -> None:
        """Nobody moves it any more: the value stays as it is at `now`."""
        self._legs = [_Leg(0, self.value(now), None, 0, STILL)]
        self._samples = []

    def _time(self, now: int) -> int:
        return self._passed + min(max(now - self._heard, 0), HOLD_AFTER)

    def _recount(self, first: int) -> None:
        """The legs anew from the input `first` on."""
        del self._legs[first + 1 :]
        for sample in self._samples[first:]:
            before = self._legs[-1]
            at = max(before.at, sample.at)
            start = self._along(before, at)
            if sample.kind is Kind.VELOCITY:
                self._legs.append(_Leg(at, start, None, 0, sample.values))
            else:
                self._legs.append(_Leg(at, start, sample.values, min(at - before.at, LONGEST_WAY), STILL))

    def _along(self, leg: _Leg, at: int) -> Vector | None:
        if leg.goal is not None:
            passed = at - leg.at
            if leg.start is None or passed >= leg.way:
                return leg.goal
            way = vector.subtract(leg.goal, leg.start)
            return vector.add(leg.start, vector.scale(way, passed / leg.way))
        if leg.start is None or leg.speed == STILL:
            return leg.start
        return within_reach(self._is_hand, vector.add(leg.start, vector.scale(leg.speed, (at - leg.at) * 1e-6)))

    def _speed(self, values: Vector) -> Vector:
        full = HAND_SPEED if self._is_hand else LEG_SPEED
        x, y, z = (min(max(part, -1.0), 1.0) * full for part in values)
        return (x, y, z) if self._is_hand else (x, 0.0, 0.0)


def within_reach(is_hand: bool, value: Vector) -> Vector:
    """The nearest place that a hand can be asked to, within an arm length of the shoulder; or the nearest thigh
    angle."""
    if not is_hand:
        return (clamp_thigh(value[0]), 0.0, 0.0)
    largest = max(abs(part) for part in value)
    if largest <= 0.5:
        return value
    # by the largest part first: the square of a huge one has no room in a float
    near = vector.scale(value, 1.0 / largest)
    reach = vector.length(near)
    return value if largest * reach <= 1.0 else vector.scale(near, 1.0 / reach)


class Late(Exception):
    """An input that does not count: its like was there before, or it is too old."""
