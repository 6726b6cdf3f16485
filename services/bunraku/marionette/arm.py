"""The potential-based arm (paper 4), closed exactly.

Upper arm, forearm and hand hang from the shoulder in one vertical plane; the hand tip is held, and gravity bends the
rest. With the tip given, three links in a plane have one freedom, the wrist bend. The bend table stores the bend of
least energy, relative to its limits; the other two joints then close on the tip to rounding error.

In the plane x points outwards from the shoulder to the tip's side and y up (the paper's Hx and z). Angles t0, t1, t2 of
the links are from x towards y, radians; `r` and `beta` are the tip's distance and elevation; lengths in arm lengths.
This module solves for angles, one arm at a time; `arm_batch` solves for positions, many arms at a time and without
trigonometry.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin

import numpy as np
import numpy.typing as npt

from bunraku.marionette.constants import MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.solver import planar_arm
from bunraku.marionette.solver.planar_arm import ArmGeometry
from bunraku.motion.rotation import Array

BendTable = npt.NDArray[np.float16]


def wrist_bend_limits(proportions: Proportions, r: Array) -> tuple[Array, Array]:
    """Return the smallest and largest wrist bend (n,) that reach `r` (n,) with elbow and wrist within their limits."""
    upper, fore, hand = proportions.lengths
    straight = upper + fore
    high = np.minimum(MAX_WRIST_BEND_RAD, _clamped_acos((r**2 - straight**2 - hand**2) / (2.0 * straight * hand)))
    folded, lean = folded_elbow(proportions)
    low = lean - MAX_ELBOW_BEND_RAD + _clamped_acos((r**2 - folded**2 - hand**2) / (2.0 * folded * hand))
    return np.minimum(np.maximum(low, 0.0), high), high


def folded_elbow(proportions: Proportions) -> tuple[float, float]:
    """Return distance and angle from the upper arm of the wrist with the elbow bent to its limit."""
    upper, fore, _ = proportions.lengths
    x, y = upper + fore * cos(MAX_ELBOW_BEND_RAD), fore * sin(MAX_ELBOW_BEND_RAD)
    return hypot(x, y), atan2(y, x)


def close_chain(proportions: Proportions, r: Array, beta: Array, bend: Array) -> tuple[Array, Array, Array]:
    """Return link angles t0, t1, t2 (n,) with the tip at (`r`, `beta`), the wrist bent by `bend`, the elbow below."""
    upper, fore, hand = proportions.lengths
    x, y = fore + hand * np.cos(bend), hand * np.sin(bend)
    lower = np.hypot(x, y)
    t0: Array = beta - _clamped_acos((upper**2 + r**2 - lower**2) / (2.0 * upper * r))
    t1: Array = t0 + _clamped_acos((r**2 - upper**2 - lower**2) / (2.0 * upper * lower)) - np.arctan2(y, x)
    return t0, t1, t1 + bend


class Arm:
    """One arm in plain floats, for a stage that solves at 60 Hz."""

    def __init__(self, proportions: Proportions, table: BendTable) -> None:
        self.proportions = proportions
        self.min_tip_distance = proportions.min_tip_distance
        self.geometry: ArmGeometry = (*proportions.lengths, self.min_tip_distance, *folded_elbow(proportions))
        self.bend_nodes: Array = table.astype(np.float64)
        """The bend table (64, 64)."""

    def clamp_distance(self, r: float) -> float:
        """Return the nearest solved distance."""
        return min(max(r, self.min_tip_distance), MAX_TIP_DISTANCE)

    def bend_limits(self, r: float) -> tuple[float, float]:
        """Return `planar_arm.bend_limits` of this arm; `r` is clamped."""
        return planar_arm.bend_limits(self.geometry, r)

    def gravity_bend(self, r: float, beta: float) -> float:
        """Return `planar_arm.gravity_bend` of this arm."""
        return planar_arm.gravity_bend(self.geometry, self.bend_nodes, r, beta)

    def close_chain(self, r: float, beta: float, bend: float) -> tuple[float, float, float]:
        """Return `planar_arm.close_chain` of this arm."""
        return planar_arm.close_chain(self.geometry, r, beta, bend)

    def solve_angles(self, r: float, beta: float) -> tuple[float, float, float]:
        """Return link angles t0, t1, t2 for a tip at distance `r` (clamped) and elevation `beta`, -pi/2..pi/2."""
        return self.close_chain(r, beta, self.gravity_bend(r, beta))


def _clamped_acos(x: Array) -> Array:
    angle: Array = np.arccos(np.clip(x, -1.0, 1.0))
    return angle
