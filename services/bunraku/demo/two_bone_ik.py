"""Two bones and a hinge: the exact bend and turn that bring the end of an arm or leg to a point.

The bones are rest offsets, `upper` from the first joint to the hinge and `lower` from the hinge to the end. They need
not be in line at rest; the hinge turns about x of its own frame, a knee by a positive angle and an elbow by a
negative one.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

KNEE_SIGN = 1.0
ELBOW_SIGN = -1.0


def end_distance(upper: Array, lower: Array, bend: float = 0.0) -> float:
    """Distance in metres from the first joint to the end, with the hinge turned by `bend` radians about x."""
    return float(np.linalg.norm(upper + rotation.rotate(rotation.from_coordinate_axis(0, np.array(bend)), lower)))


def solve_two_bone(upper: Array, lower: Array, target: Array, pole: Array, hinge_sign: float) -> tuple[Array, Array]:
    """Orientation (n, 4) of the first joint and flexion (n,) in radians, never below 0, that bring the end to `target`.

    `target` (n, 3) metres from the first joint and `pole` (n, 3), the direction in which the hinge points out, are in
    one frame, that of the first joint's parent; the orientation is in it too. `hinge` is `KNEE` or `ELBOW`: the sign
    of flexion about x. A target out of reach (further than the rest pose reaches, or nearer than 150 degrees of
    flexion) is met in direction only. `pole` must not be along `target`.
    """
    target = np.asarray(target, dtype=np.float64)
    furthest = end_distance(upper, lower)
    nearest = end_distance(upper, lower, hinge_sign * np.radians(150.0))
    distance = np.clip(np.linalg.norm(target, axis=-1), nearest, furthest)
    # |upper + Rx(bend) lower|^2 is a constant and one cosine of the bend
    along = upper[1] * lower[1] + upper[2] * lower[2]
    across = upper[2] * lower[1] - upper[1] * lower[2]
    fixed = upper @ upper + lower @ lower + 2.0 * upper[0] * lower[0]
    cosine = (distance**2 - fixed) / (2.0 * np.hypot(along, across))
    bend = np.arctan2(across, along) + hinge_sign * np.arccos(np.clip(cosine, -1.0, 1.0))
    flexion = np.clip(hinge_sign * bend, 0.0, None)
    end = upper + rotation.rotate(rotation.from_coordinate_axis(0, hinge_sign * flexion), lower)
    # the local frame (direction of the end, hinge axis square to it) goes to the same frame about the target
    axis = np.broadcast_to(np.array([1.0, 0.0, 0.0]), end.shape)
    turned = rotation.multiply(
        rotation.from_matrix(_direction_frame(target, hinge_sign * np.cross(pole, target))),
        rotation.conjugate(rotation.from_matrix(_direction_frame(end, axis))),
    )
    return turned, flexion


def _direction_frame(direction: Array, axis: Array) -> Array:
    """Matrices (n, 3, 3) whose columns are the unit `direction`, `axis` made square to it, and their cross product."""
    first = rotation.normalise(direction)
    second = rotation.normalise(axis - np.sum(axis * first, axis=-1, keepdims=True) * first)
    return np.stack([first, second, np.cross(first, second)], axis=-1)
