"""What a puppeteer's inputs say: where the limb should be.

The value is a hand target (arm lengths, in the shoulder's frame) or the thigh's angle (radians, first of the three).
A target sets it; a velocity moves it from the time of its sample until the next input. Times are clock time in µs.
"""

from __future__ import annotations

from enum import IntEnum
from math import isfinite

from bunraku.marionette import vector
from bunraku.marionette.leg import clamp_thigh
from bunraku.marionette.limbs import Limb
from bunraku.marionette.vector import Vector

HAND_SPEED = 1.0
"""Arm lengths per second at full speed along one axis."""
LEG_SPEED = 2.0
"""Radians per second at full speed."""
HOLD_AFTER = 250_000
"""Without a word from the puppeteer for this many µs the limb holds still."""

STILL: Vector = (0.0, 0.0, 0.0)


class Kind(IntEnum):
    """What the three numbers of an input are; the numbers are the contract's."""

    VELOCITY = 0
    TARGET = 1


class Steering:
    """One limb in one puppeteer's hands. `value` is None until the stage gives the dance's own by `begin`."""

    def __init__(self, limb: Limb, now: int, value: Vector | None = None) -> None:
        self.limb = limb
        self.value = value
        self._velocity = STILL
        self._until = now
        self._sampled = now
        self._heard = now

    @property
    def heard(self) -> int:
        """When the puppeteer last said anything about this limb."""
        return self._heard

    def begin(self, value: Vector, now: int) -> None:
        """Starts from where the limb is, unless an input has said already."""
        if self.value is None:
            self.value = value
            self._until = now

    def hear(self, now: int) -> None:
        """The puppeteer is there; a limb that held still moves on from now."""
        self.advance(now)
        self._heard = max(self._heard, now)

    def target(self, value: Vector, sampled: int, now: int) -> None:
        """Sets the value. Raises `ValueError` if a number is not finite."""
        _finite(value)
        self.hear(now)
        self.value = self._clamp(value)
        self._velocity = STILL
        self._sampled = max(self._sampled, min(sampled, now))

    def velocity(self, speed: Vector, sampled: int, now: int) -> None:
        """Moves the value at `speed`, -1..1 of full speed, from the time it was sampled: what has been shown since at
        the speed before is made good. Raises `ValueError` if a number is not finite."""
        _finite(speed)
        self.hear(now)
        full = HAND_SPEED if self.limb.is_hand else LEG_SPEED
        x, y, z = (min(max(part, -1.0), 1.0) * full for part in speed)
        wanted = (x, y, z) if self.limb.is_hand else (x, 0.0, 0.0)
        since = max(self._sampled, min(sampled, now), now - HOLD_AFTER)
        if self.value is not None:
            late = max(0, self._until - since) * 1e-6
            change = vector.subtract(wanted, self._velocity)
            self.value = self._clamp(vector.add(self.value, vector.scale(change, late)))
        self._velocity = wanted
        self._sampled = since

    def stop(self, now: int) -> None:
        """Nobody moves it any more: the value stays as it is at `now`."""
        self.advance(now)
        self._velocity = STILL

    def advance(self, now: int) -> None:
        """Moves the value on to `now`, but no farther than `HOLD_AFTER` past the last word."""
        if self.value is not None:
            moving = min(now, self._heard + HOLD_AFTER) - self._until
            if moving > 0:
                self.value = self._clamp(vector.add(self.value, vector.scale(self._velocity, moving * 1e-6)))
        self._until = max(self._until, now)

    def _clamp(self, value: Vector) -> Vector:
        if not self.limb.is_hand:
            return (clamp_thigh(value[0]), 0.0, 0.0)
        largest = max(abs(part) for part in value)
        if largest <= 0.5:
            return value
        # by the largest part first: the square of a huge one has no room in a float
        near = vector.scale(value, 1.0 / largest)
        reach = vector.length(near)
        return vector.scale(near, min(largest, 1.0 / reach))


def _finite(value: Vector) -> None:
    if not all(isfinite(part) for part in value):
        raise ValueError(f"an input's numbers must be finite, not {value}")
