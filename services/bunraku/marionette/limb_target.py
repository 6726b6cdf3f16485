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
HOLD_TIMEOUT_US = 250_000
"""Without a word from the puppeteer for this many µs the limb holds still. An input counts as made no earlier than this
before it came."""
MAX_TARGET_DURATION_US = 33_000
"""A target is gone to in this many µs at most."""
MAX_REORDERED_INPUTS = 64
"""Inputs that a late one may come after."""

ZERO_VELOCITY: Vector = (0.0, 0.0, 0.0)


class InputKind(IntEnum):
    """What the three numbers of an input are; the numbers are the contract's."""

    VELOCITY = 0
    TARGET = 1


class _Sample(NamedTuple):
    sequence: int
    time_us: int
    kind: InputKind
    values: Vector


class _Segment(NamedTuple):
    """From one input to the next: `start` at `at`, then towards `goal` in `way` µs, or on at `speed` a second."""

    begin_us: int
    start: Vector | None
    goal: Vector | None
    duration_us: int
    velocity: Vector


class LimbTarget:
    """One limb in one puppeteer's hands. `value` is None until an input or `begin` says where the limb is.

    It keeps its own time in µs: since it was made, less what its puppeteer was silent for beyond `HOLD_AFTER`.
    """

    def __init__(self, is_hand: bool, now: int) -> None:
        self._is_hand = is_hand
        self._last_heard_us = now
        self._elapsed_us = 0
        self._min_delay_us: int | None = None
        self._last_dropped_sequence = -1
        self._samples: list[_Sample] = []
        self._segments = [_Segment(0, None, None, 0, ZERO_VELOCITY)]

    @property
    def last_heard_us(self) -> int:
        """When the puppeteer last said anything about this limb."""
        return self._last_heard_us

    def value_at(self, now: int) -> Vector | None:
        """Where the limb should be at `now`."""
        leg = self._segments[-1]
        return self._value_on_segment(leg, max(self._local_time_us(now), leg.begin_us))

    def set_start(self, value: Vector) -> None:
        """Says where the limb was when it was taken, unless that was said before."""
        first = self._segments[0]
        if first.start is None:
            self._segments[0] = first._replace(start=value)
            self._rebuild_segments(0)

    def keep_alive(self, now: int) -> None:
        """The puppeteer is there; a limb that held still moves on from now."""
        self._elapsed_us = self._local_time_us(now)
        self._last_heard_us = max(self._last_heard_us, now)

    def add_input(self, kind: InputKind, values: Vector, sequence: int, sampled_us: int, now: int) -> bool:
        """Takes an input in; whether it asked for a place within reach.

        Raises `ValueError` if a number is not finite, `Late` for a sequence that came before, or comes after `KEPT`
        newer.
        """
        if not all(isfinite(part) for part in values):
            raise ValueError(f"an input's numbers must be finite, not {values}")
        at = bisect_left(self._samples, sequence, key=lambda sample: sample.sequence)
        if sequence <= self._last_dropped_sequence or (
            at < len(self._samples) and self._samples[at].sequence == sequence
        ):
            raise LateInput
        self.keep_alive(now)
        lag = now - sampled_us
        self._min_delay_us = lag if self._min_delay_us is None else min(self._min_delay_us, lag)
        made = self._elapsed_us - min(lag - self._min_delay_us, HOLD_TIMEOUT_US)
        within = self._scale_velocity(values) if kind is InputKind.VELOCITY else clamp_to_reach(self._is_hand, values)
        self._samples.insert(at, _Sample(sequence, max(made, 0), kind, within))
        self._rebuild_segments(at)
        if len(self._samples) > MAX_REORDERED_INPUTS:
            self._last_dropped_sequence = self._samples.pop(0).sequence
            self._segments.pop(0)
        return kind is InputKind.VELOCITY or (within[0] == values[0] and (not self._is_hand or within == values))

    def stop(self, now: int) -> None:
        """Nobody moves it any more: the value stays as it is at `now`."""
        self._segments = [_Segment(0, self.value_at(now), None, 0, ZERO_VELOCITY)]
        self._samples = []

    def _local_time_us(self, now: int) -> int:
        return self._elapsed_us + min(max(now - self._last_heard_us, 0), HOLD_TIMEOUT_US)

    def _rebuild_segments(self, first: int) -> None:
        """The legs anew from the input `first` on."""
        del self._segments[first + 1 :]
        for sample in self._samples[first:]:
            before = self._segments[-1]
            at = max(before.begin_us, sample.time_us)
            start = self._value_on_segment(before, at)
            if sample.kind is InputKind.VELOCITY:
                self._segments.append(_Segment(at, start, None, 0, sample.values))
            else:
                self._segments.append(
                    _Segment(at, start, sample.values, min(at - before.begin_us, MAX_TARGET_DURATION_US), ZERO_VELOCITY)
                )

    def _value_on_segment(self, segment: _Segment, time_us: int) -> Vector | None:
        if segment.goal is not None:
            passed = time_us - segment.begin_us
            if segment.start is None or passed >= segment.duration_us:
                return segment.goal
            way = vector.subtract(segment.goal, segment.start)
            return vector.add(segment.start, vector.scale(way, passed / segment.duration_us))
        if segment.start is None or segment.velocity == ZERO_VELOCITY:
            return segment.start
        return clamp_to_reach(
            self._is_hand,
            vector.add(segment.start, vector.scale(segment.velocity, (time_us - segment.begin_us) * 1e-6)),
        )

    def _scale_velocity(self, values: Vector) -> Vector:
        full = HAND_SPEED if self._is_hand else LEG_SPEED
        x, y, z = (min(max(part, -1.0), 1.0) * full for part in values)
        return (x, y, z) if self._is_hand else (x, 0.0, 0.0)


def clamp_to_reach(is_hand: bool, value: Vector) -> Vector:
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


class LateInput(Exception):
    """An input that does not count: its like was there before, or it is too old."""
