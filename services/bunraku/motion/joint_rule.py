"""Rules by which the figure's joints follow the joints of a source.

The fit chooses one rule for each joint of the figure, from all frames of the source. Afterwards each frame is converted
by itself: the position of a joint follows from its parent and the figure's offsets, its orientation from the rule.
`FigureFit` applies the rules to whole clips, live capture to single frames.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array


@dataclass(frozen=True, slots=True)
class Aim:
    """Smallest rotation after which `offset` (3,), in the joint's frame, points from `start` to `target`.

    Both are indices of source joints; a `start` of None is the position of the figure's joint itself.
    """

    offset: Array
    target: int
    start: int | None = None


@dataclass(frozen=True, slots=True)
class NearestPoints:
    """Rotation that brings `local_positions` (m, 3), in the joint's frame, nearest to the source joints `targets`.

    Distances count by `weights` (m,).
    """

    local_positions: Array
    targets: tuple[int, ...]
    weights: Array


@dataclass(frozen=True, slots=True)
class JointRule:
    """Orientation of one joint of the figure in the world.

    It is that of the joint `copied` of the figure, or the solution of `nearest`, or the rotation of the source joint
    `source` from its rest pose after `rest` (4,), the rotation of the figure's rest pose to the source's. Then `aim`
    corrects it.
    """

    source: int | None = None
    rest: Array = field(default_factory=rotation.IDENTITY.copy)
    copied: int | None = None
    nearest: NearestPoints | None = None
    aim: Aim | None = None

    def __post_init__(self) -> None:
        if sum(origin is not None for origin in (self.source, self.copied, self.nearest)) != 1:
            raise ValueError("a rule has one of source, copied and nearest")


def aim_at(orientation: Array, offset: Array, start: Array, target: Array) -> Array:
    """Return `orientation` (n, 4) with the smallest rotation that aims `offset` (3,) from `start` (n, 3) at `target`
    (n, 3)."""
    there = target - start
    turn = rotation.rotation_between(rotation.rotate(orientation, offset), there)
    # a target at the joint itself has no direction
    near = np.linalg.norm(there, axis=-1, keepdims=True) < MIN_AIM_DISTANCE_M
    return rotation.normalise(rotation.multiply(np.where(near, rotation.IDENTITY, turn), orientation))


MIN_AIM_DISTANCE_M = 1e-6
"""Targets nearer than this have no direction."""
