"""Upper arm, forearm and hand in their plane, one arm at a time: the triangle they make, closed by numbers alone.

Plain functions of plain numbers, so that `compiled` can compile them as they stand. Angles are in radians, lengths in
arm lengths; `r` is the tip's distance from the shoulder, within `inner`..`OUTER_RADIUS`.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, sin, sqrt

from bunraku.marionette.proportions import MAX_ELBOW_BEND_RAD, MAX_WRIST_BEND_RAD
from bunraku.motion.rotation import Array

TABLE_SIDE = 64
"""A table has SIDE x SIDE nodes: rows from the inner radius to the outer, columns from straight down to straight up."""


ArmGeometry = tuple[float, float, float, float, float, float]
"""Lengths of upper arm, forearm and hand, and what follows from them: the nearest that a tip is solved for; the
distance from shoulder to wrist with the elbow bent to its limit, and that wrist's angle from the upper arm. A plain
tuple, as those are handed to compiled code in no time."""


def bend_limits(geometry: ArmGeometry, r: float) -> tuple[float, float]:
    """Least and greatest wrist bend that reach `r` with elbow and wrist within their limits."""
    upper, fore, hand, _, folded, lean = geometry
    straight = upper + fore
    high = min(MAX_WRIST_BEND_RAD, clamped_acos((r * r - straight * straight - hand * hand) / (2.0 * straight * hand)))
    low = lean - MAX_ELBOW_BEND_RAD + clamped_acos((r * r - folded * folded - hand * hand) / (2.0 * folded * hand))
    return min(max(low, 0.0), high), high


def gravity_bend(geometry: ArmGeometry, nodes: Array, r: float, beta: float) -> float:
    """The wrist bend at which gravity leaves an arm with its tip at `r` and elevation `beta`, from its table `nodes`
    (SIDE, SIDE), float64."""
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
    """Angles t0, t1, t2 of the links that bring the tip to `r` and elevation `beta` with the wrist bent by `bend`,
    elbow below.

    Exact for any `bend` within `limits`; beyond them the arm does not reach, or a joint breaks its limit.
    """
    upper, fore, hand, _, _, _ = geometry
    x, y = fore + hand * cos(bend), hand * sin(bend)
    lower = sqrt(x * x + y * y)
    t0 = beta - clamped_acos((upper * upper + r * r - lower * lower) / (2.0 * upper * r))
    t1 = t0 + clamped_acos((r * r - upper * upper - lower * lower) / (2.0 * upper * lower)) - atan2(y, x)
    return t0, t1, t1 + bend


def lift_for_bend(geometry: ArmGeometry, r: float, bend: float) -> float:
    """How far the upper arm is off the chord, the line from shoulder to tip, with the wrist bent by `bend`."""
    upper, fore, hand, _, _, _ = geometry
    square = fore * fore + hand * hand + 2.0 * fore * hand * cos(bend)
    return clamped_acos((upper * upper + r * r - square) / (2.0 * upper * r))


def bend_for_lift(geometry: ArmGeometry, r: float, lift: float, min_bend: float, max_bend: float) -> float:
    """The wrist bend, within `low`..`high`, of an upper arm `lift` off the chord."""
    # at a limit the cosine has lost the digits that tell the bend
    if lift >= lift_for_bend(geometry, r, min_bend):
        return min_bend
    upper, fore, hand, _, _, _ = geometry
    square = upper * upper + r * r - 2.0 * upper * r * cos(lift)
    bend = clamped_acos((square - fore * fore - hand * hand) / (2.0 * fore * hand))
    return min(max(bend, min_bend), max_bend)


def max_distance_for_lift(geometry: ArmGeometry, r: float, lift: float) -> float:
    """The farthest distance, no farther than `r`, whose upper arm is lifted by `lift` off the chord."""
    near, far = geometry[3], r
    for _ in range(40):
        middle = 0.5 * (near + far)
        if lift_for_bend(geometry, middle, bend_limits(geometry, middle)[0]) >= lift:
            near = middle
        else:
            far = middle
    return near


def clamped_acos(x: float) -> float:
    """The arc cosine of a number that rounding may have brought beyond -1..1."""
    return acos(min(max(x, -1.0), 1.0))
