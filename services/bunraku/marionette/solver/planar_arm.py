"""Upper arm, forearm and hand in their plane, one arm at a time.

Plain functions of plain numbers, so that `_kernels` can compile them. Angles are in radians, lengths in arm lengths;
`r` is the tip's distance from the shoulder, between the arm's smallest solved distance and `MAX_TIP_DISTANCE`.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, sin, sqrt

from bunraku.marionette.constants import MAX_ELBOW_BEND_RAD, MAX_WRIST_BEND_RAD, TABLE_SIDE
from bunraku.motion.rotation import Array

ArmGeometry = tuple[float, float, float, float, float, float]
"""Lengths of upper arm, forearm and hand, and three numbers that follow from them.

These are the smallest solved distance of the tip, the distance from shoulder to wrist with the elbow bent to its limit,
and that wrist's angle from the upper arm. A plain tuple: passing one to compiled code costs almost nothing.
"""


def bend_limits(geometry: ArmGeometry, r: float) -> tuple[float, float]:
    """Return the smallest and largest wrist bend that reach `r` with elbow and wrist within their limits."""
    upper, fore, hand, _, folded, lean = geometry
    straight = upper + fore
    high = min(MAX_WRIST_BEND_RAD, clamped_acos((r * r - straight * straight - hand * hand) / (2.0 * straight * hand)))
    low = lean - MAX_ELBOW_BEND_RAD + clamped_acos((r * r - folded * folded - hand * hand) / (2.0 * folded * hand))
    return min(max(low, 0.0), high), high


def gravity_bend(geometry: ArmGeometry, nodes: Array, r: float, beta: float) -> float:
    """Return the wrist bend of least energy with the tip at `r` and elevation `beta`.

    `nodes` (64, 64) is the arm's bend table in float64.
    """
    q = sqrt((1.0 - r) / (1.0 - geometry[3]))
    level, up = cos(beta), sin(beta)
    u = (1.0 - q) * (1.0 + 0.75 * q) * (TABLE_SIDE - 1)
    v = 0.5 * (1.0 + up / (level + abs(up))) * (TABLE_SIDE - 1)
    i, j = min(max(int(u), 0), TABLE_SIDE - 2), min(max(int(v), 0), TABLE_SIDE - 2)
    p, q = u - i, v - j
    share = (float(nodes[i, j]) * (1.0 - q) + float(nodes[i, j + 1]) * q) * (1.0 - p)
    share += (float(nodes[i + 1, j]) * (1.0 - q) + float(nodes[i + 1, j + 1]) * q) * p
    low, high = bend_limits(geometry, r)
    least, greatest = sin(0.5 * low), sin(0.5 * high)
    return 2.0 * asin(least + share * (greatest - least))


def close_chain(geometry: ArmGeometry, r: float, beta: float, bend: float) -> tuple[float, float, float]:
    """Return the link angles t0, t1, t2 with the tip at `r` and elevation `beta`, the wrist bent by `bend`.

    The elbow is below the chord. The result is exact for any `bend` within `bend_limits`; beyond them the arm does not
    reach, or a joint exceeds its limit.
    """
    upper, fore, hand, _, _, _ = geometry
    x, y = fore + hand * cos(bend), hand * sin(bend)
    lower = sqrt(x * x + y * y)
    t0 = beta - clamped_acos((upper * upper + r * r - lower * lower) / (2.0 * upper * r))
    t1 = t0 + clamped_acos((r * r - upper * upper - lower * lower) / (2.0 * upper * lower)) - atan2(y, x)
    return t0, t1, t1 + bend


def lift_for_bend(geometry: ArmGeometry, r: float, bend: float) -> float:
    """Return the angle of the upper arm off the chord (from shoulder to tip) with the wrist bent by `bend`."""
    upper, fore, hand, _, _, _ = geometry
    square = fore * fore + hand * hand + 2.0 * fore * hand * cos(bend)
    return clamped_acos((upper * upper + r * r - square) / (2.0 * upper * r))


def bend_for_lift(geometry: ArmGeometry, r: float, lift: float, min_bend: float, max_bend: float) -> float:
    """Return the wrist bend, within `min_bend` and `max_bend`, of an upper arm `lift` off the chord."""
    # at a limit the cosine has no digits left for the bend
    if lift >= lift_for_bend(geometry, r, min_bend):
        return min_bend
    upper, fore, hand, _, _, _ = geometry
    square = upper * upper + r * r - 2.0 * upper * r * cos(lift)
    bend = clamped_acos((square - fore * fore - hand * hand) / (2.0 * fore * hand))
    return min(max(bend, min_bend), max_bend)


def max_distance_for_lift(geometry: ArmGeometry, r: float, lift: float) -> float:
    """Return the largest distance up to `r` at which the upper arm can be `lift` off the chord."""
    nearest, farthest = geometry[3], r
    for _ in range(40):
        middle = 0.5 * (nearest + farthest)
        if lift_for_bend(geometry, middle, bend_limits(geometry, middle)[0]) >= lift:
            nearest = middle
        else:
            farthest = middle
    return nearest


def clamped_acos(x: float) -> float:
    """Return the arc cosine of a number that rounding may have moved beyond -1..1."""
    return acos(min(max(x, -1.0), 1.0))
