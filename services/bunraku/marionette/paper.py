"""Arm of the paper (paper 4.2, 4.3) as a reference for measurements: three angles in a table, interpolated.

Nodes are evenly spaced over the half disc, 100 divisions of the distance and 18 of the elevation. Each node holds the
angles t0, t1, t2 of least potential, float32. Between nodes they are bilinear, so the tip misses its target slightly.
Elbow and wrist have no limits, as in the paper, but bend in their natural direction only: among poses of equal
potential the one closest to the neighbours is chosen, because angles would jump between nodes otherwise.

In the plane x points outwards and y up; angles are from x towards y, radians; lengths are in arm lengths.
"""

from __future__ import annotations

from math import pi

import numpy as np
import numpy.typing as npt

from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

DISTANCE_NODES, ELEVATION_NODES = 101, 19
"""Nodes along r, 0..1, and along beta, -pi/2..pi/2."""
PAPER_BYTES = DISTANCE_NODES * ELEVATION_NODES * 3 * 4
"""Size of a table: 23,028. The paper says "within 8 kB", which one of the three angles takes."""

PaperTable = npt.NDArray[np.float32]
_SCAN_SAMPLES = 181
_BISECTIONS = 40
_AXIS_OFFSET_RAD = 1e-6
"""Offset of the nodes on the vertical axis, where an arm may bow to either side: it bows as beside the axis."""


def build_paper_table(proportions: Proportions) -> PaperTable:
    """Return the angles (3, 101, 19) of least potential, by a scan of all poses and bisection.

    A node too near for an arm with one long link has the angles of the nearest position within reach.
    """
    r, beta = np.meshgrid(
        np.linspace(0.0, 1.0, DISTANCE_NODES), np.linspace(-0.5, 0.5, ELEVATION_NODES) * pi, indexing="ij"
    )
    r = np.maximum(r, 2.0 * max(proportions.lengths) - 1.0 + 1e-9)
    beta = np.clip(beta, -0.5 * pi + _AXIS_OFFSET_RAD, 0.5 * pi - _AXIS_OFFSET_RAD)
    step = 2.0 * pi / (_SCAN_SAMPLES - 1)
    best, lowest = np.zeros(r.shape), np.full(r.shape, np.inf)

    def keep_lower(turn: Array) -> None:
        nonlocal best, lowest
        height = _potential(proportions, _close_chain(proportions, r, beta, turn))
        # by more than rounding: the first of equal poses is kept
        lower = height < lowest - 1e-13
        best, lowest = np.where(lower, turn, best), np.where(lower, height, lowest)

    for nth in range(_SCAN_SAMPLES):
        keep_lower(np.full(r.shape, nth * step))
    for _ in range(_BISECTIONS):
        step *= 0.5
        middle = best
        keep_lower(middle - step)
        keep_lower(middle + step)
    return _close_chain(proportions, r, beta, best).astype(np.float32)


def paper_angles(table: PaperTable, r: Array, beta: Array) -> Array:
    """Return angles t0, t1, t2 (3, n) for tips at (`r`, `beta`), 0..1 and -pi/2..pi/2, by bilinear interpolation."""
    u, v = r * (DISTANCE_NODES - 1), (beta / pi + 0.5) * (ELEVATION_NODES - 1)
    i = np.clip(u.astype(np.int64), 0, DISTANCE_NODES - 2)
    j = np.clip(v.astype(np.int64), 0, ELEVATION_NODES - 2)
    p, q = u - i, v - j
    nodes = table.astype(np.float64)
    angles: Array = (nodes[:, i, j] * (1.0 - q) + nodes[:, i, j + 1] * q) * (1.0 - p)
    angles += (nodes[:, i + 1, j] * (1.0 - q) + nodes[:, i + 1, j + 1] * q) * p
    return angles


def joint_positions(proportions: Proportions, angles: Array) -> npt.NDArray[np.complex128]:
    """Return elbow, wrist and tip (3, n) of link angles (3, n), as x + iy in the arm's plane."""
    links = np.array(proportions.lengths)[:, None] * np.exp(1j * angles)
    joints: npt.NDArray[np.complex128] = np.cumsum(links, axis=0)
    return joints


def tip_error(proportions: Proportions, table: PaperTable, r: Array, beta: Array) -> Array:
    """Return the distances (n,) of tips from their targets, in arm lengths: the paper's measure (4.3)."""
    error: Array = np.abs(joint_positions(proportions, paper_angles(table, r, beta))[2] - r * np.exp(1j * beta))
    return error


def _close_chain(proportions: Proportions, r: Array, beta: Array, turn: Array) -> Array:
    """Return link angles (3, ...) with the tip at (`r`, `beta`) and the upper arm `turn` below the chord.

    NaN if the rest of the arm does not reach, or a joint would bend backwards.
    """
    upper, fore, hand = proportions.lengths
    rest = upper**2 + r**2 - 2.0 * upper * r * np.cos(turn)
    cosine = (rest - fore**2 - hand**2) / (2.0 * fore * hand)
    bend = np.arccos(np.clip(cosine, -1.0, 1.0))
    # from the upper arm to the segment from elbow to tip, in the direction in which an elbow bends
    chord = np.angle(r * np.exp(1j * turn) - upper)
    chord = np.where(chord < -1e-9, chord + 2.0 * pi, chord)
    elbow = chord - np.arctan2(hand * np.sin(bend), fore + hand * np.cos(bend))
    possible = (np.abs(cosine) <= 1.0 + 1e-12) & (elbow >= -1e-7) & (elbow <= pi + 1e-7)
    t0 = beta - turn
    return np.where(possible, np.array([t0, t0 + elbow, t0 + elbow + bend]), np.nan)


def _potential(proportions: Proportions, angles: Array) -> Array:
    """Return twice the part of the paper's E that depends on the pose, without g; infinite for no pose."""
    upper, fore, _ = proportions.lengths
    m0, m1, m2 = proportions.masses
    height = (m0 + 2.0 * m1 + m2) * upper * np.sin(angles[0]) + (m1 + m2) * fore * np.sin(angles[1])
    return np.where(np.isnan(height), np.inf, height)
