"""Conversion between the figure's axes and Unity's, which VMC, MVN's Unity stream and Rokoko use.

Unity's frame is left-handed: y up, z the direction a figure faces, x to its right (Unity Manual, "Rotation and
orientation in Unity"). The figure's frame has x to its left; the others are the same. The conversion mirrors x, so it
is its own inverse. Lengths stay in metres.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array

_MIRRORED_VECTOR: Array = np.array([-1.0, 1.0, 1.0])
_MIRRORED_ROTATION: Array = np.array([1.0, 1.0, -1.0, -1.0])


def mirror_vectors(vectors: Array) -> Array:
    """Convert vectors (..., 3) from either frame to the other."""
    mirrored: Array = vectors * _MIRRORED_VECTOR
    return mirrored


def mirror_rotations(rotations: Array) -> Array:
    """Convert quaternions (..., 4), order w x y z, from either frame to the other."""
    mirrored: Array = rotations * _MIRRORED_ROTATION
    return mirrored


def from_xyzw(rotations: Array) -> Array:
    """Reorder quaternions (..., 4) from Unity's order x y z w to w x y z."""
    return np.roll(rotations, 1, axis=-1)


def to_xyzw(rotations: Array) -> Array:
    """Reorder quaternions (..., 4) from w x y z to Unity's order x y z w."""
    return np.roll(rotations, -1, axis=-1)
