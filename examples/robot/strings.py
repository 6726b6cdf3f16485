"""Strings from which the robot hangs, as a marionette: they pull and never push, with a limited tension."""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array

STRETCH_M = 0.06
"""Stretch at which the strings together carry their share of the weight, metres."""
WEIGHT_SHARE = 0.75
"""Share of the robot's weight that the strings carry when each point is where the performer's is."""
MAX_TENSION_SHARE = 0.5
"""Limit of one string's tension, as a share of the weight."""
LENGTH_M = 1.0
"""Length of a stretched string in the performer's pose, metres."""
DAMPING_RATIO = 0.5
"""Damping of a stretched string, relative to critical damping of its share of the mass."""


def string_forces(points: Array, velocities: Array, wanted: Array, mass: float) -> Array:
    """Return the forces (n, 3) of `n` strings in newtons.

    `points` (n, 3) and `velocities` (n, 3) are those of the robot; `wanted` (n, 3) the same points of the performer,
    `LENGTH_M` below the bar that holds the strings; `mass` is the robot's, kg.
    """
    count, weight = len(points), mass * 9.81
    stiffness = WEIGHT_SHARE * weight / STRETCH_M / count
    damping = 2 * DAMPING_RATIO * np.sqrt(stiffness * mass / count)
    along = wanted + np.array([0.0, LENGTH_M, 0.0]) - points
    length = np.linalg.norm(along, axis=1)
    direction = along / np.maximum(length, 1e-6)[:, None]
    stretch = length - (LENGTH_M - STRETCH_M)
    tension = stiffness * stretch - damping * (direction * velocities).sum(axis=1)
    tension = np.where(stretch > 0, np.clip(tension, 0.0, MAX_TENSION_SHARE * weight), 0.0)
    forces: Array = direction * tension[:, None]
    return forces
