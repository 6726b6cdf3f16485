"""Fit of one joint's orientation to the points that it carries.

A source bends its spine in several joints, LOA-1 between root and head in one, vl5. The orientation of vl5 is therefore
solved: in each frame the rotation that brings neck and shoulders nearest to the source's (Kabsch 1976), alternating
with the points' local positions, which are the mean over the frames (generalised Procrustes analysis, Gower 1975).
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

PROCRUSTES_ITERATIONS = 12


def solve_kabsch(points: Array, targets: Array, weights: Array) -> Array:
    """Return rotations (..., 4) of `points` (m, 3) nearest to `targets` (..., m, 3)."""
    covariance = np.einsum("m,...mi,mj->...ij", weights, targets, points)
    u, _, v = np.linalg.svd(covariance)
    proper = np.linalg.det(u) * np.linalg.det(v)
    u[..., :, 2] *= proper[..., None]
    return rotation.from_matrix(u @ v)


def mean_local_positions(orientation: Array, targets: Array) -> Array:
    """Return the mean positions (m, 3) of `targets` (n, m, 3) in the frame of a joint; `orientation` (n, 4)."""
    places: Array = rotation.rotate(rotation.conjugate(orientation)[:, None], targets).mean(axis=0)
    return places


def rms_error(orientation: Array, local_positions: Array, targets: Array, weights: Array) -> float:
    """Return the weighted RMS distance of `local_positions` (m, 3) from `targets` (n, m, 3).

    `orientation` (n, 4) rotates the local positions.
    """
    apart = np.sum((rotation.rotate(orientation[:, None], local_positions) - targets) ** 2, axis=-1)
    return float(np.sqrt((apart @ weights).mean() / weights.sum()))


def fit_local_positions(orientation: Array, targets: Array, weights: Array, rest_positions: Array) -> Array:
    """Return local positions (m, 3) that, rotated anew in every frame, come nearest to `targets` (n, m, 3).

    `orientation` (n, 4) is the initial guess. The result is rotated as a whole to lie nearest to `rest_positions` (m,
    3), so that the joint's identity is the source's rest.
    """
    places = mean_local_positions(orientation, targets)
    for _ in range(PROCRUSTES_ITERATIONS):
        places = mean_local_positions(solve_kabsch(places, targets, weights), targets)
    turned: Array = rotation.rotate(solve_kabsch(places, rest_positions[None], weights)[0], places)
    return turned
