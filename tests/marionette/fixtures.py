"""Arms, targets and motions that several tests use."""

from __future__ import annotations

import numpy as np

from bunraku.marionette.proportions import Proportions
from bunraku.motion import rotation
from bunraku.motion.rotation import Array

ARM_PROPORTIONS = tuple(
    Proportions.parse(identity)
    for identity in ("3963-3523-2514-5316-3440-1244", "400-400-200-334-333-333", "300-300-400-560-320-120")
)


def random_tips(proportions: Proportions, count: int, seed: int) -> Array:
    """Return random reachable hand tips (count, 3), uniform in direction and distance."""
    random = np.random.default_rng(seed)
    direction = random.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    reach: Array = random.uniform(proportions.min_tip_distance, 1.0 - 1e-6, (count, 1))
    return direction * reach


def random_motion(frames: int, seed: int, fps: float = 60.0) -> Array:
    """Return rotations (frames, 18, 4) of a smooth motion: joints swing, the body turns, elbows bend forwards."""
    random = np.random.default_rng(seed)
    t = (np.arange(frames) / fps)[:, None, None]
    hertz, phase = random.uniform(0.2, 1.5, (18, 3)), random.uniform(0.0, 6.3, (18, 3))
    swing = random.uniform(0.0, 0.8, (18, 3))
    swing[0] = random.uniform(0.0, 0.3, 3)
    v = swing * np.sin(2.0 * np.pi * hertz * t + phase)
    v[:, 0, 1] += 2.0 * t[:, 0, 0]
    v[:, [13, 16], 0] = -np.abs(v[:, [13, 16], 0])
    return rotation.from_rotation_vector(v)
