"""Bend table of an arm: the wrist bend of least energy for each position of the hand tip, relative to its limits.

A value s in 0..1 gives the bend d by its half sine: sin(d/2) = sin(lo/2) + s (sin(hi/2) - sin(lo/2)). Values are
float16: 8,192 bytes, within the paper's 8 kB. Rows are evenly spaced in (1 - q)(1 + 3q/4) with q = sqrt((1 - r) / (1 -
r_min)): denser where the arm straightens and where it folds, because angles change fast there. Columns are evenly
spaced in y / (x + |y|), x and y being the horizontal and vertical part of the tip: an elevation without an angle.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bunraku.marionette.arm import BendTable, close_chain, wrist_bend_limits
from bunraku.marionette.constants import MAX_TIP_DISTANCE, TABLE_SIDE
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

TABLE_BYTES = TABLE_SIDE * TABLE_SIDE * 2
_SCAN_SAMPLES = 65
_BISECTIONS = 40


def potential(proportions: Proportions, r: Array, beta: Array, bend: Array) -> Array:
    """Return twice the part of the paper's E (paper 4) that depends on the bend, without g; uniform rods, y up."""
    upper, fore, _ = proportions.lengths
    m0, m1, m2 = proportions.masses
    t0, t1, _ = close_chain(proportions, r, beta, bend)
    height: Array = (m0 + 2.0 * m1 + m2) * upper * np.sin(t0) + (m1 + m2) * fore * np.sin(t1)
    return height


def node_coordinates(proportions: Proportions) -> tuple[Array, Array]:
    """Return distance and elevation (radians) of the nodes, (64, 64) each."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, TABLE_SIDE), np.linspace(-1.0, 1.0, TABLE_SIDE), indexing="ij")
    q = (np.sqrt(1.0 + 48.0 * (1.0 - u)) - 1.0) / 6.0
    r = np.minimum(1.0 - (1.0 - proportions.min_tip_distance) * q * q, MAX_TIP_DISTANCE)
    return r, np.arctan2(v, 1.0 - np.abs(v))


def build_bend_table(proportions: Proportions) -> BendTable:
    """Return the table (64, 64) of these proportions: rows by distance, columns by elevation."""
    r, beta = node_coordinates(proportions)
    least, greatest = (np.sin(0.5 * bend) for bend in wrist_bend_limits(proportions, r))
    bend = min_potential_bend(proportions, r, beta)
    share = (np.sin(0.5 * bend) - least) / np.maximum(greatest - least, 1e-12)
    table: BendTable = np.clip(share, 0.0, 1.0).astype(np.float16)
    return table


def min_potential_bend(proportions: Proportions, r: Array, beta: Array) -> Array:
    """Return the wrist bend of least potential, radians, of the shape of `r`: a scan, then bisection."""
    low, high = wrist_bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, _SCAN_SAMPLES)
    lowest, best = np.full(r.shape, np.inf), np.zeros(r.shape, dtype=np.int64)
    for nth, share in enumerate(shares):
        height = potential(proportions, r, beta, low + share * (high - low))
        best = np.where(height < lowest, nth, best)
        lowest = np.minimum(height, lowest)
    # the minimum is next to the lowest sample: bisect on the sign of the slope
    left, right = shares[np.maximum(best - 1, 0)], shares[np.minimum(best + 1, _SCAN_SAMPLES - 1)]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (left + right)
        rising = _potential_slope(proportions, r, beta, low + middle * (high - low)) > 0.0
        left, right = np.where(rising, left, middle), np.where(rising, middle, right)
    return low + 0.5 * (left + right) * (high - low)


def _potential_slope(proportions: Proportions, r: Array, beta: Array, bend: Array) -> Array:
    """Return a number with the sign of the potential's derivative by the bend.

    It is zero where (A+B) cos t0 sin(t2-t1) = B cos t1 sin(t2-t0).
    """
    m0, m1, m2 = proportions.masses
    t0, t1, t2 = close_chain(proportions, r, beta, bend)
    slope: Array = (m0 + 2.0 * m1 + m2) * np.cos(t0) * np.sin(t2 - t1) - (m1 + m2) * np.cos(t1) * np.sin(t2 - t0)
    return slope


@lru_cache(maxsize=64)
def load_bend_table(identity: str) -> BendTable:
    """Return the table of `Proportions.identity`, built once. Raises `ProportionsError`."""
    table = build_bend_table(Proportions.parse(identity))
    table.flags.writeable = False
    return table


def pack_bend_table(table: BendTable) -> bytes:
    """Return `TABLE_BYTES` bytes: float16, little-endian, row by row."""
    return table.astype("<f2").tobytes()


def parse_bend_table(data: bytes) -> BendTable:
    """Return the table in `data`. Raises ValueError for another length or a value outside 0..1."""
    if len(data) != TABLE_BYTES:
        raise ValueError(f"bend table rejected: {len(data)} bytes, expected {TABLE_BYTES}")
    table = np.frombuffer(data, dtype="<f2").reshape(TABLE_SIDE, TABLE_SIDE).astype(np.float16)
    if not bool(((table >= 0.0) & (table <= 1.0)).all()):
        raise ValueError("bend table rejected: a value is outside 0..1")
    return table
