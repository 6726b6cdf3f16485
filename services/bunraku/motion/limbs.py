"""Arms and legs of the figure: where they lie at rest, and how they follow the source's joints."""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

DOWN: Array = np.array([0.0, -1.0, 0.0])
FRONTAL = 0.35
"""A bone whose part across and up is smaller than this points forwards or back."""


def turn_down(bone: Array) -> Array:
    """The turn (4,) that brings a limb's bone (3,), in the figure's axes, to hang straight down.

    First about z, as an arm is lowered from a T- or A-pose: a palm that faced the floor then faces the thigh. What is
    left, forwards or back, goes about x. A bone that points forwards at rest goes about x alone.
    """
    x, y, z = rotation.normalise(bone).tolist()
    across = float(np.hypot(x, y))
    if across < FRONTAL:
        return rotation.between(bone, DOWN)
    lowered = rotation.about_axis(2, np.arctan2(-x, -y))
    return rotation.multiply(rotation.about_axis(0, np.arctan2(z, across)), lowered)


def mean_length(start: Array, end: Array) -> float:
    """The mean distance between two tracks of positions (n, 3)."""
    return float(np.linalg.norm(end - start, axis=-1).mean())


def aimed(orientation: Array, offset: Array, start: Array, target: Array) -> Array:
    """`orientation` (n, 4) with the least turn that points `offset` (3,) from `start` (n, 3) at `target` (n, 3)."""
    there = target - start
    turn = rotation.between(rotation.rotate(orientation, offset), there)
    # a target at the joint itself gives no direction
    near = np.linalg.norm(there, axis=-1, keepdims=True) < 1e-6
    return rotation.normalise(rotation.multiply(np.where(near, rotation.IDENTITY, turn), orientation))
