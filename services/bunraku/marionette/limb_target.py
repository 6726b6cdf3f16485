"""Target of a limb, computed from a puppeteer's inputs.

The value is a hand target (arm lengths, in the shoulder's frame) or a thigh angle (radians, the first of three). A
target input is approached linearly, in the time between the last two inputs, so that a stream of inputs moves evenly
and not in steps. A velocity input moves the value until the next input. Inputs are applied in the order of their
sequence numbers: a late input is inserted at its place, and the value is the same as if it had come in time.

The sample time of an input is on the sender's clock. It is compared with the sender's other inputs only: the one with
the smallest delay is taken to have had none. So the offset of that clock does not matter. Times are clock time in µs.
"""

from __future__ import annotations

from bisect import bisect_left
from enum import IntEnum
from math import isfinite
from typing import NamedTuple

from bunraku.marionette.constants import MAX_HAND_SPEED, MAX_LEG_SPEED, MAX_TARGET_DURATION_US
from bunraku.marionette.leg import clamp_thigh
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import ZERO, Vector

HOLD_TIMEOUT_US = 250_000
"""Time without an input after which the limb holds still; also the largest assumed delay of an input."""
MAX_REORDERED_INPUTS = 64
"""Inputs that may overtake a late one."""


class InputKind(IntEnum):
    """Meaning of the three values of an input; the numbers are those of the contract."""

    VELOCITY = 0
    TARGET = 1


class _Sample(NamedTuple):
    sequence: int
    time_us: int
    kind: InputKind
    values: Vector


class _Segment(NamedTuple):
    """Interval from one input to the next: from `start` to `goal` in `duration_us`, or on at `velocity`."""

    begin_us: int
    start: Vector | None
    goal: Vector | None
    duration_us: int
    velocity: Vector


class LimbTarget:
    """Target of one limb held by one puppeteer; unknown (None) until an input or `set_start`.

    It has a local time in µs, which runs from its creation and stops while the puppeteer is silent for longer than
    `HOLD_TIMEOUT_US`.
    """

    def __init__(self, is_hand: bool, now: int) -> None:
        self._is_hand = is_hand
        self._last_heard_us = now
        self._elapsed_us = 0
        self._last_input_us: int | None = None
        self._min_delay_us: int | None = None
        self._last_dropped_sequence = -1
        self._samples: list[_Sample] = []
        self._segments = [_Segment(0, None, None, 0, ZERO)]

    @property
    def last_heard_us(self) -> int:
        """Time of the last input or keep-alive for this limb."""
        return self._last_heard_us

    def input_age_us(self, now: int) -> int | None:
        """Return the time since the last input, 0 while one moves the limb, None before the first."""
        if self._last_input_us is None:
            return None
        return 0 if self._segments[-1].velocity != ZERO else max(now - self._last_input_us, 0)

    def value_at(self, now: int) -> Vector | None:
        """Return the target at `now`."""
        segment = self._segments[-1]
        return self._value_on_segment(segment, max(self._local_time_us(now), segment.begin_us))

    def set_start(self, value: Vector) -> None:
        """Set the position of the limb at the claim, unless it is set already."""
        first = self._segments[0]
        if first.start is None:
            self._segments[0] = first._replace(start=value)
            self._rebuild_segments(0)

    def keep_alive(self, now: int) -> None:
        """Record that the puppeteer is connected; a limb that held still moves on from now."""
        self._elapsed_us = self._local_time_us(now)
        self._last_heard_us = max(self._last_heard_us, now)

    def add_input(self, kind: InputKind, values: Vector, sequence: int, sampled_us: int, now: int) -> bool:
        """Add an input; return whether its target is within reach.

        Raises ValueError for a number that is not finite, and `LateInput` for a duplicate or an input that more than
        `MAX_REORDERED_INPUTS` have overtaken.
        """
        if not all(isfinite(part) for part in values):
            raise ValueError(f"input rejected: the values must be finite, not {values}")
        at = bisect_left(self._samples, sequence, key=lambda sample: sample.sequence)
        if sequence <= self._last_dropped_sequence or (
            at < len(self._samples) and self._samples[at].sequence == sequence
        ):
            raise LateInput
        self.keep_alive(now)
        self._last_input_us = now
        lag = now - sampled_us
        self._min_delay_us = lag if self._min_delay_us is None else min(self._min_delay_us, lag)
        sample_time_us = self._elapsed_us - min(lag - self._min_delay_us, HOLD_TIMEOUT_US)
        within = self._scale_velocity(values) if kind is InputKind.VELOCITY else clamp_to_reach(self._is_hand, values)
        self._samples.insert(at, _Sample(sequence, max(sample_time_us, 0), kind, within))
        self._rebuild_segments(at)
        if len(self._samples) > MAX_REORDERED_INPUTS:
            self._last_dropped_sequence = self._samples.pop(0).sequence
            self._segments.pop(0)
        return kind is InputKind.VELOCITY or (within[0] == values[0] and (not self._is_hand or within == values))

    def stop(self, now: int) -> None:
        """Freeze the target at its value at `now`."""
        self._segments = [_Segment(0, self.value_at(now), None, 0, ZERO)]
        self._samples = []

    def follow(self, value: Vector) -> None:
        """Replace the target by the place to which another puppeteer has moved the limb; earlier inputs have no effect.

        The next input starts from there.
        """
        if self._samples:
            self._last_dropped_sequence = self._samples[-1].sequence
        self._segments = [_Segment(0, value, None, 0, ZERO)]
        self._samples = []

    def _local_time_us(self, now: int) -> int:
        return self._elapsed_us + min(max(now - self._last_heard_us, 0), HOLD_TIMEOUT_US)

    def _rebuild_segments(self, first: int) -> None:
        """Rebuild the segments from the sample `first` on."""
        del self._segments[first + 1 :]
        for sample in self._samples[first:]:
            before = self._segments[-1]
            at = max(before.begin_us, sample.time_us)
            start = self._value_on_segment(before, at)
            if sample.kind is InputKind.VELOCITY:
                self._segments.append(_Segment(at, start, None, 0, sample.values))
            else:
                self._segments.append(
                    _Segment(at, start, sample.values, min(at - before.begin_us, MAX_TARGET_DURATION_US), ZERO)
                )

    def _value_on_segment(self, segment: _Segment, time_us: int) -> Vector | None:
        if segment.goal is not None:
            passed = time_us - segment.begin_us
            if segment.start is None or passed >= segment.duration_us:
                return segment.goal
            path = vector.subtract(segment.goal, segment.start)
            return vector.add(segment.start, vector.scale(path, passed / segment.duration_us))
        if segment.start is None or segment.velocity == ZERO:
            return segment.start
        return clamp_to_reach(
            self._is_hand,
            vector.add(segment.start, vector.scale(segment.velocity, (time_us - segment.begin_us) * 1e-6)),
        )

    def _scale_velocity(self, values: Vector) -> Vector:
        full_speed = MAX_HAND_SPEED if self._is_hand else MAX_LEG_SPEED
        x, y, z = (min(max(part, -1.0), 1.0) * full_speed for part in values)
        return (x, y, z) if self._is_hand else (x, 0.0, 0.0)


def clamp_to_reach(is_hand: bool, value: Vector) -> Vector:
    """Return the nearest target within an arm length of the shoulder, or the nearest angle of a thigh."""
    if not is_hand:
        return (clamp_thigh(value[0]), 0.0, 0.0)
    largest = max(abs(part) for part in value)
    if largest <= 0.5:
        return value
    # scale by the largest part first: the square of a huge number overflows
    near = vector.scale(value, 1.0 / largest)
    reach = vector.length(near)
    return value if largest * reach <= 1.0 else vector.scale(near, 1.0 / reach)


class LateInput(Exception):
    """Duplicate input, or one received too late."""
