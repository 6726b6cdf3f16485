"""The leg (paper 4): the thigh is lifted by an angle, the shank hangs, the ankle is fixed.

Angles are in radians. The thigh's angle is measured from straight down, forwards positive.
"""

from __future__ import annotations

import numpy as np

from bunraku.marionette.constants import MAX_THIGH_ANGLE_RAD, MIN_THIGH_ANGLE_RAD
from bunraku.motion.rotation import Array


def clamp_thigh(theta: float) -> float:
    """Return the nearest angle within the limits of a thigh."""
    return min(max(theta, MIN_THIGH_ANGLE_RAD), MAX_THIGH_ANGLE_RAD)


def knee_bend(theta: float) -> float:
    """Return the bend of the knee with which the shank hangs; 0 for a thigh behind the vertical."""
    return max(0.0, theta)


def solve_legs(theta: Array) -> tuple[Array, Array]:
    """Return hip and knee angles (n,) for thigh angles (n,), within the thigh's limits."""
    hip: Array = np.clip(theta, MIN_THIGH_ANGLE_RAD, MAX_THIGH_ANGLE_RAD)
    return hip, np.maximum(0.0, hip)
