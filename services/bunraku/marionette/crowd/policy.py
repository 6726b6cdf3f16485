"""Merge policies of a crowd: how many pulls of a limb become one target."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from bunraku.marionette.constants import MAX_THIGH_ANGLE_RAD
from bunraku.marionette.crowd.summary import UNITS, CrowdSummary, Integers, Point
from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.limb_target import clamp_to_reach
from bunraku.marionette.solver.vector import Vector
from bunraku.wire.limbs import LIMBS

TRIM = 0.2
"""Share of the pulls that the trimmed mean leaves out at each end of an axis.

A share f <= TRIM of saboteurs moves it by at most f / (1 - 2 TRIM) of the distance over which the others are spread.
"""
TURN_US = 5_000_000
"""Duration of a member's turn."""
VOTE_US = 2_000_000
"""Interval between the counts of votes."""
HAND_GESTURES: dict[str, Vector] = {
    "up": (0.2, 0.9, 0.2),
    "side": (0.9, 0.0, 0.2),
    "front": (0.1, 0.1, 0.9),
    "down": (0.2, -0.9, 0.1),
    "across": (-0.5, 0.1, 0.7),
}
"""Places of the left hand, in arm lengths; x of the right hand has the other sign."""
LEG_GESTURES: dict[str, float] = {"up": 1.4, "front": 0.7, "down": 0.0, "back": -0.5}
"""Angles of a thigh, radians."""


class CrowdPolicy(StrEnum):
    """Merge policy of a limb; the values are those of the contract."""

    MEDIAN = "median"
    TRIMMED_MEAN = "trimmed mean"
    TURNS = "turns"
    VOTE = "vote"


def _limb_of(limb: int) -> Limb:
    return Limb(limb % len(LIMBS))


def to_point(limb: int, values: Vector) -> Point:
    """Return a target of limb number `limb`, moved into reach, in units."""
    is_hand = _limb_of(limb).is_hand
    near = clamp_to_reach(is_hand, values)
    x, y, z = near if is_hand else (near[0] / MAX_THIGH_ANGLE_RAD, 0.0, 0.0)
    return round(x * UNITS), round(y * UNITS), round(z * UNITS)


def to_target(limb: int, point: tuple[float, float, float]) -> Vector:
    """Return the target of a point of -1..1 on three axes."""
    is_hand = _limb_of(limb).is_hand
    return clamp_to_reach(is_hand, point if is_hand else (point[0] * MAX_THIGH_ANGLE_RAD, 0.0, 0.0))


def gesture_points(limb: int) -> Integers:
    """Return the points (n, 3) of the gestures of a limb, in units and in the order of the tables."""
    kind = _limb_of(limb)
    if not kind.is_hand:
        return np.array([to_point(limb, (angle, 0.0, 0.0)) for angle in LEG_GESTURES.values()])
    mirror = 1.0 if kind is Limb.LEFT_HAND else -1.0
    return np.array([to_point(limb, (mirror * x, y, z)) for x, y, z in HAND_GESTURES.values()])


def mean_target(summary: CrowdSummary, policy: CrowdPolicy) -> tuple[float, float, float]:
    """Return the median or the trimmed mean of a summary that is not empty, on each axis, in -1..1."""
    count = summary.count
    if policy is CrowdPolicy.MEDIAN:
        return summary.mean_between((count - 1) / 2, (count + 1) / 2)
    return summary.mean_between(TRIM * count, (1.0 - TRIM) * count)
