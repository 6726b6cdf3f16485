"""The table of an arm: for each place of the hand tip, where between its limits gravity leaves the wrist bend.

Nodes are even in u = 1 - sqrt((1 - r) / (1 - inner)), which spaces them closer where the arm straightens and the angles
change fast, and in the elevation. Values are in 0..1, float16: 8,192 bytes, within the paper's 8 kB.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi

import numpy as np

from bunraku.marionette.arm import SIDE, Table, bend_limits, close
from bunraku.marionette.proportions import OUTER_RADIUS, Proportions
from bunraku.motion.rotation import Array

TABLE_BYTES = SIDE * SIDE * 2
_SCAN = 65
_HALVINGS = 40


def potential(proportions: Proportions, r: Array, beta: Array, bend: Array) -> Array:
    """The part of the paper's E (paper 4) that the bend can change, twice and without g; uniform rods, y up."""
    upper, fore, _ = proportions.lengths
    m0, m1, m2 = proportions.masses
    t0, t1, _ = close(proportions, r, beta, bend)
    height: Array = (m0 + 2.0 * m1 + m2) * upper * np.sin(t0) + (m1 + m2) * fore * np.sin(t1)
    return height


def build_table(proportions: Proportions) -> Table:
    """The (SIDE, SIDE) table of these proportions: rows by distance, columns by elevation."""
    u = np.linspace(0.0, 1.0, SIDE)[:, None]
    inner = proportions.inner_radius
    r = np.minimum(1.0 - (1.0 - inner) * (1.0 - u) ** 2, OUTER_RADIUS)
    r, beta = np.broadcast_arrays(r, (np.linspace(-0.5, 0.5, SIDE) * pi)[None, :])
    low, high = bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, _SCAN)
    scan = potential(proportions, r, beta, low + shares[:, None, None] * (high - low))
    best = np.argmin(scan, axis=0)
    # the lowest sample and its neighbours hold the minimum; halve on the sign of the slope
    left, right = shares[np.maximum(best - 1, 0)], shares[np.minimum(best + 1, _SCAN - 1)]
    for _ in range(_HALVINGS):
        middle = 0.5 * (left + right)
        rising = _slope(proportions, r, beta, low + middle * (high - low)) > 0.0
        left, right = np.where(rising, left, middle), np.where(rising, middle, right)
    table: Table = (0.5 * (left + right)).astype(np.float16)
    return table


def _slope(proportions: Proportions, r: Array, beta: Array, bend: Array) -> Array:
    """Of the sign of the potential's change with the bend; zero where (A+B) cos t0 sin(t2-t1) = B cos t1 sin(t2-t0)."""
    m0, m1, m2 = proportions.masses
    t0, t1, t2 = close(proportions, r, beta, bend)
    slope: Array = (m0 + 2.0 * m1 + m2) * np.cos(t0) * np.sin(t2 - t1) - (m1 + m2) * np.cos(t1) * np.sin(t2 - t0)
    return slope


@lru_cache(maxsize=64)
def table_of(identity: str) -> Table:
    """The table known by this identity (`Proportions.identity`), built once. Raises `ProportionsError`."""
    table = build_table(Proportions.parse(identity))
    table.flags.writeable = False
    return table


def to_bytes(table: Table) -> bytes:
    """`TABLE_BYTES` bytes: float16, little-endian, row by row."""
    return table.astype("<f2").tobytes()


def from_bytes(data: bytes) -> Table:
    """The table in `data`. Raises `ValueError` if there are not `TABLE_BYTES` or a value is outside 0..1."""
    if len(data) != TABLE_BYTES:
        raise ValueError(f"a table of an arm has {TABLE_BYTES} bytes, not {len(data)}")
    table = np.frombuffer(data, dtype="<f2").reshape(SIDE, SIDE).astype(np.float16)
    if not bool(((table >= 0.0) & (table <= 1.0)).all()):
        raise ValueError("a table of an arm has values in 0..1 only")
    return table
