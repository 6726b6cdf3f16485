"""Upper arm, forearm and hand in their plane, one arm at a time: the triangle they make, closed by numbers alone.

Plain functions of plain numbers, so that `compiled` can compile them as they stand. Angles are in radians, lengths in
arm lengths; `r` is the tip's distance from the shoulder, within `inner`..`OUTER_RADIUS`.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, sin, sqrt

from bunraku.marionette.proportions import ELBOW_LIMIT, WRIST_LIMIT
from bunraku.motion.rotation import Array

SIDE = 64
"""A table has SIDE x SIDE nodes: rows from the inner radius to the outer, columns from straight down to straight up."""


Links = tuple[float, float, float, float, float, float]
"""Lengths of upper arm, forearm and hand, and what follows from them: the nearest that a tip is solved for; the
distance from shoulder to wrist with the elbow bent to its limit, and that wrist's angle from the upper arm. A plain
tuple, as those are handed to compiled code in no time."""


def limits(links: Links, r: float) -> tuple[float, float]:
    """Least and greatest wrist bend that reach `r` with elbow and wrist within their limits."""
    upper, fore, hand, _, folded, lean = links
    straight = upper + fore
    high = min(WRIST_LIMIT, arc_cosine((r * r - straight * straight - hand * hand) / (2.0 * straight * hand)))
    low = lean - ELBOW_LIMIT + arc_cosine((r * r - folded * folded - hand * hand) / (2.0 * folded * hand))
    return min(max(low, 0.0), high), high


def gravity(links: Links, nodes: Array, r: float, beta: float) -> float:
    """The wrist bend at which gravity leaves an arm with its tip at `r` and elevation `beta`, from its table `nodes`
    (SIDE, SIDE), float64."""
    q = sqrt((1.0 - r) / (1.0 - links[3]))
    level, up = cos(beta), sin(beta)
    u = (1.0 - q) * (1.0 + 0.75 * q) * (SIDE - 1)
    v = 0.5 * (1.0 + up / (level + abs(up))) * (SIDE - 1)
    i, j = min(max(int(u), 0), SIDE - 2), min(max(int(v), 0), SIDE - 2)
    p, q = u - i, v - j
    share = (float(nodes[i, j]) * (1.0 - q) + float(nodes[i, j + 1]) * q) * (1.0 - p)
    share += (float(nodes[i + 1, j]) * (1.0 - q) + float(nodes[i + 1, j + 1]) * q) * p
    low, high = limits(links, r)
    least, greatest = sin(0.5 * low), sin(0.5 * high)
    return 2.0 * asin(least + share * (greatest - least))


def close(links: Links, r: float, beta: float, bend: float) -> tuple[float, float, float]:
    """Angles t0, t1, t2 of the links that bring the tip to `r` and elevation `beta` with the wrist bent by `bend`,
    elbow below.

    Exact for any `bend` within `limits`; beyond them the arm does not reach, or a joint breaks its limit.
    """
    upper, fore, hand, _, _, _ = links
    x, y = fore + hand * cos(bend), hand * sin(bend)
    lower = sqrt(x * x + y * y)
    t0 = beta - arc_cosine((upper * upper + r * r - lower * lower) / (2.0 * upper * r))
    t1 = t0 + arc_cosine((r * r - upper * upper - lower * lower) / (2.0 * upper * lower)) - atan2(y, x)
    return t0, t1, t1 + bend


def lift_of(links: Links, r: float, bend: float) -> float:
    """How far the upper arm is off the chord, the line from shoulder to tip, with the wrist bent by `bend`."""
    upper, fore, hand, _, _, _ = links
    square = fore * fore + hand * hand + 2.0 * fore * hand * cos(bend)
    return arc_cosine((upper * upper + r * r - square) / (2.0 * upper * r))


def bend_of(links: Links, r: float, lift: float, low: float, high: float) -> float:
    """The wrist bend, within `low`..`high`, of an upper arm `lift` off the chord."""
    # at a limit the cosine has lost the digits that tell the bend
    if lift >= lift_of(links, r, low):
        return low
    upper, fore, hand, _, _, _ = links
    square = upper * upper + r * r - 2.0 * upper * r * cos(lift)
    bend = arc_cosine((square - fore * fore - hand * hand) / (2.0 * fore * hand))
    return min(max(bend, low), high)


def nearer(links: Links, r: float, lift: float) -> float:
    """The farthest distance, no farther than `r`, whose upper arm is lifted by `lift` off the chord."""
    near, far = links[3], r
    for _ in range(40):
        middle = 0.5 * (near + far)
        if lift_of(links, middle, limits(links, middle)[0]) >= lift:
            near = middle
        else:
            far = middle
    return near


def arc_cosine(x: float) -> float:
    """The arc cosine of a number that rounding may have brought beyond -1..1."""
    return acos(min(max(x, -1.0), 1.0))
