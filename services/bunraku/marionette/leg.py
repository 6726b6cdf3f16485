"""The leg (paper 4): the thigh is lifted by an angle, the shank hangs, the ankle is fixed.

Angles are radians. The thigh's is from straight down, forwards positive.
"""

from __future__ import annotations

from math import pi

import numpy as np

from bunraku.motion.rotation import Array

MIN_THIGH_ANGLE_RAD = -pi / 4.0
"""The farthest back a thigh is pulled."""
MAX_THIGH_ANGLE_RAD = 2.0 * pi / 3.0
"""The farthest up a thigh is pulled."""


def clamp_thigh(theta: float) -> float:
    """The nearest angle a thigh is pulled to."""
    return min(max(theta, MIN_THIGH_ANGLE_RAD), MAX_THIGH_ANGLE_RAD)


def knee_bend(theta: float) -> float:
    """How far the knee bends so that the shank hangs; a thigh pulled back keeps it straight, as knees bend one way."""
    return max(0.0, theta)


def solve_legs(theta: Array) -> tuple[Array, Array]:
    """Hip and knee angles (n,) for thigh angles (n,), within the thigh's limits."""
    hip: Array = np.clip(theta, MIN_THIGH_ANGLE_RAD, MAX_THIGH_ANGLE_RAD)
    return hip, np.maximum(0.0, hip)
