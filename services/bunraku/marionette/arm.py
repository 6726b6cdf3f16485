"""The potential-based arm (paper 4), closed exactly.

Upper arm, forearm and hand hang from the shoulder in one vertical plane; the hand tip is held, and gravity bends the
rest. With the tip given, three links in a plane have one freedom left. The table stores it, as the place of the wrist
bend between its limits; the other two joints then close on the tip to rounding error.

In the plane: x outwards from the shoulder to the tip's side, y up (the paper's Hx and z). Angles t0, t1, t2 of the
links are from x towards y, radians; `r` and `beta` are the tip's distance and elevation; lengths are in arm lengths.
In space: the shoulder's place is the origin and y is up; the azimuth of the plane is from z (forwards) towards x.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, cos, hypot, pi, sin, sqrt

import numpy as np
import numpy.typing as npt

from bunraku.marionette.proportions import ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT, Proportions
from bunraku.motion.rotation import Array

Table = npt.NDArray[np.float16]
SIDE = 64
"""A table has SIDE x SIDE nodes: rows from the inner radius to the outer, columns from straight down to straight up."""


def bend_limits(proportions: Proportions, r: Array) -> tuple[Array, Array]:
    """Least and greatest wrist bend (n,) in radians that reach `r` (n,) with elbow and wrist within their limits."""
    upper, fore, hand = proportions.lengths
    straight = upper + fore
    high = np.minimum(WRIST_LIMIT, _acos((r**2 - straight**2 - hand**2) / (2.0 * straight * hand)))
    x, y = upper + fore * cos(ELBOW_LIMIT), fore * sin(ELBOW_LIMIT)
    folded, lean = hypot(x, y), atan2(y, x)
    low = lean - ELBOW_LIMIT + _acos((r**2 - folded**2 - hand**2) / (2.0 * folded * hand))
    return np.minimum(np.maximum(low, 0.0), high), high


def close(proportions: Proportions, r: Array, beta: Array, bend: Array) -> tuple[Array, Array, Array]:
    """Link angles t0, t1, t2 (n,) that bring the tip to (`r`, `beta`) with the wrist bent by `bend`, elbow below."""
    upper, fore, hand = proportions.lengths
    x, y = fore + hand * np.cos(bend), hand * np.sin(bend)
    lower = np.hypot(x, y)
    t0: Array = beta - _acos((upper**2 + r**2 - lower**2) / (2.0 * upper * r))
    t1: Array = t0 + _acos((r**2 - upper**2 - lower**2) / (2.0 * upper * lower)) - np.arctan2(y, x)
    return t0, t1, t1 + bend


@dataclass(frozen=True, slots=True)
class Arms:
    """Solved arms: `azimuth`, `t0`, `t1`, `t2` (n,) in radians; `elbow`, `wrist`, `tip` (n, 3) in arm lengths, y up."""

    azimuth: Array
    t0: Array
    t1: Array
    t2: Array
    elbow: Array
    wrist: Array
    tip: Array


def solve(proportions: Proportions, table: Table, targets: Array) -> Arms:
    """The arms whose tips are at `targets` (n, 3), in arm lengths with y up.

    A target nearer than the inner radius or farther than the arm is brought to the limit with its direction kept; one
    at the shoulder itself counts as straight below. Straight above or below, the plane is the one that faces forwards.
    """
    x, y, z = (np.asarray(targets, dtype=np.float64)[..., i] for i in range(3))
    # nearer than 1e-12 there is no direction to keep
    lost = np.hypot(np.hypot(x, z), y) < 1e-12
    x, y, z = np.where(lost, 0.0, x), np.where(lost, -1e-12, y), np.where(lost, 0.0, z)
    azimuth, rho = np.arctan2(x, z), np.hypot(x, z)
    beta = np.arctan2(y, rho)
    inner = proportions.inner_radius
    r = np.clip(np.hypot(rho, y), inner, OUTER_RADIUS)
    u = (1.0 - np.sqrt((1.0 - r) / (1.0 - inner))) * (SIDE - 1)
    v = (beta / pi + 0.5) * (SIDE - 1)
    i = np.clip(u.astype(np.int64), 0, SIDE - 2)
    j = np.clip(v.astype(np.int64), 0, SIDE - 2)
    p, q = u - i, v - j
    node = table.astype(np.float64)
    share = (node[i, j] * (1.0 - q) + node[i, j + 1] * q) * (1.0 - p)
    share += (node[i + 1, j] * (1.0 - q) + node[i + 1, j + 1] * q) * p
    low, high = bend_limits(proportions, r)
    t0, t1, t2 = close(proportions, r, beta, low + share * (high - low))
    forwards = np.stack([np.sin(azimuth), np.zeros_like(azimuth), np.cos(azimuth)], axis=-1)
    joint = np.zeros((*azimuth.shape, 3))
    places = []
    for size, t in zip(proportions.lengths, (t0, t1, t2), strict=True):
        joint = joint + size * (np.cos(t)[..., None] * forwards + np.sin(t)[..., None] * np.array([0.0, 1.0, 0.0]))
        places.append(joint)
    return Arms(azimuth, t0, t1, t2, places[0], places[1], places[2])


class Arm:
    """One arm at a time, in plain floats: the path for a stage that solves at 60 Hz. Same answers as `solve`."""

    def __init__(self, proportions: Proportions, table: Table) -> None:
        self.proportions = proportions
        self.inner = proportions.inner_radius
        self._node: list[list[float]] = table.astype(np.float64).tolist()
        upper, fore, _ = proportions.lengths
        x, y = upper + fore * cos(ELBOW_LIMIT), fore * sin(ELBOW_LIMIT)
        self._folded, self._lean = hypot(x, y), atan2(y, x)

    def clamp(self, r: float) -> float:
        """The nearest distance that is solved for."""
        return min(max(r, self.inner), OUTER_RADIUS)

    def limits(self, r: float) -> tuple[float, float]:
        """Least and greatest wrist bend, radians, that reach `r` (clamped) with elbow and wrist within their limits."""
        upper, fore, hand = self.proportions.lengths
        straight, folded = upper + fore, self._folded
        high = min(WRIST_LIMIT, _acos1((r * r - straight * straight - hand * hand) / (2.0 * straight * hand)))
        low = self._lean - ELBOW_LIMIT + _acos1((r * r - folded * folded - hand * hand) / (2.0 * folded * hand))
        return min(max(low, 0.0), high), high

    def bend(self, r: float, beta: float) -> float:
        """The wrist bend, radians, at which gravity leaves an arm with its tip at (`r`, `beta`), from the table."""
        u = (1.0 - sqrt((1.0 - r) / (1.0 - self.inner))) * (SIDE - 1)
        v = (beta / pi + 0.5) * (SIDE - 1)
        i, j = min(max(int(u), 0), SIDE - 2), min(max(int(v), 0), SIDE - 2)
        p, q = u - i, v - j
        row, after = self._node[i], self._node[i + 1]
        share = (row[j] * (1.0 - q) + row[j + 1] * q) * (1.0 - p)
        share += (after[j] * (1.0 - q) + after[j + 1] * q) * p
        low, high = self.limits(r)
        return low + share * (high - low)

    def close(self, r: float, beta: float, bend: float) -> tuple[float, float, float]:
        """Link angles t0, t1, t2 that bring the tip to (`r`, `beta`) with the wrist bent by `bend`, elbow below.

        Exact for any `bend` within `limits(r)`; beyond them the arm does not reach, or a joint breaks its limit.
        """
        upper, fore, hand = self.proportions.lengths
        x, y = fore + hand * cos(bend), hand * sin(bend)
        lower = hypot(x, y)
        t0 = beta - _acos1((upper * upper + r * r - lower * lower) / (2.0 * upper * r))
        t1 = t0 + _acos1((r * r - upper * upper - lower * lower) / (2.0 * upper * lower)) - atan2(y, x)
        return t0, t1, t1 + bend

    def angles(self, r: float, beta: float) -> tuple[float, float, float]:
        """Link angles t0, t1, t2 for a tip at distance `r` (already clamped) and elevation `beta`, -pi/2..pi/2."""
        return self.close(r, beta, self.bend(r, beta))


def _acos(x: Array) -> Array:
    angle: Array = np.arccos(np.clip(x, -1.0, 1.0))
    return angle


def _acos1(x: float) -> float:
    return acos(min(max(x, -1.0), 1.0))
