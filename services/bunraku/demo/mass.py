"""Centre of mass of the body from the positions of joints and tips.

Segment masses and centres are those of Winter, "Biomechanics and Motor Control of Human Movement", table 4.1, with the
trunk divided into pelvis and chest at vl5.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX

CROWN, LEFT_HAND, RIGHT_HAND, LEFT_TOES, RIGHT_TOES = range(JOINT_COUNT, JOINT_COUNT + 5)
"""Indices of the tips in `skeleton.joint_and_tip_positions`."""

_LIMB_SEGMENTS: tuple[tuple[str, str, float, float], ...] = (
    ("shoulder", "elbow", 0.028, 0.436),
    ("elbow", "wrist", 0.016, 0.430),
    ("hip", "knee", 0.100, 0.433),
    ("knee", "ankle", 0.0465, 0.433),
)
"""Segments of either side: joints, share of the body's mass, and relative position of the centre between the joints."""


def _point_weights() -> Array:
    """Return the weight of each point (23,) in the centre of mass; the sum is 1."""
    share = np.zeros(JOINT_COUNT + 5)

    def segment(near: int, far: int, mass: float, centre: float) -> None:
        share[near] += mass * (1.0 - centre)
        share[far] += mass * centre

    for side, hand, toes in (("l", LEFT_HAND, LEFT_TOES), ("r", RIGHT_HAND, RIGHT_TOES)):
        for near, far, mass, centre in _LIMB_SEGMENTS:
            segment(JOINT_INDEX[f"{side}_{near}"], JOINT_INDEX[f"{side}_{far}"], mass, centre)
        segment(JOINT_INDEX[f"{side}_wrist"], hand, 0.006, 0.5)
        segment(JOINT_INDEX[f"{side}_ankle"], toes, 0.0145, 0.5)
        # half the chest, from vl5 towards each shoulder
        segment(JOINT_INDEX["vl5"], JOINT_INDEX[f"{side}_shoulder"], 0.1775, 0.55)
    segment(JOINT_INDEX["skullbase"], CROWN, 0.081, 0.5)
    segment(JOINT_INDEX["humanoid_root"], JOINT_INDEX["sacroiliac"], 0.142, 0.5)
    return share


POINT_WEIGHTS: Array = _point_weights()


def centre_of_mass(points: Array) -> Array:
    """Return the centre of mass (..., 3) in metres of a body with joints and tips at `points` (..., 23, 3)."""
    centre: Array = np.einsum("k,...kj->...j", POINT_WEIGHTS, points)
    return centre
