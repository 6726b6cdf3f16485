"""Inverse kinematics of two bones and a hinge: exact bend and rotation that bring the end of a limb to a point.

The bones are rest offsets, `upper` from the first joint to the hinge and `lower` from the hinge to the end. They need
not be collinear at rest; the hinge rotates about x of its own frame, a knee by a positive angle and an elbow by a
negative one.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array

KNEE_SIGN = 1.0
ELBOW_SIGN = -1.0


def end_distance(upper: Array, lower: Array, bend: float = 0.0) -> float:
    """Return the distance in metres from the first joint to the end, with the hinge rotated by `bend` radians about
    x."""
    return float(np.linalg.norm(upper + rotation.rotate(rotation.from_coordinate_axis(0, np.array(bend)), lower)))


def solve_two_bone(upper: Array, lower: Array, target: Array, pole: Array, hinge_sign: float) -> tuple[Array, Array]:
    """Return orientation (n, 4) of the first joint and flexion (n,) >= 0 in radians that bring the end to `target`.

    `target` (n, 3) in metres from the first joint and `pole` (n, 3), the direction of the hinge, are in the frame of
    the first joint's parent, as is the orientation. `hinge_sign` is `KNEE_SIGN` or `ELBOW_SIGN`: the sign of flexion
    about x. A target out of reach (farther than the rest pose, or nearer than 150 degrees of flexion) is met in
    direction only. `pole` must not be parallel to `target`.
    """
    target = np.asarray(target, dtype=np.float64)
    furthest = end_distance(upper, lower)
    nearest = end_distance(upper, lower, hinge_sign * np.radians(150.0))
    distance = np.clip(np.linalg.norm(target, axis=-1), nearest, furthest)
    # |upper + Rx(bend) lower|^2 is a constant plus one cosine of the bend
    along = upper[1] * lower[1] + upper[2] * lower[2]
    across = upper[2] * lower[1] - upper[1] * lower[2]
    fixed = upper @ upper + lower @ lower + 2.0 * upper[0] * lower[0]
    cosine = (distance**2 - fixed) / (2.0 * np.hypot(along, across))
    bend = np.arctan2(across, along) + hinge_sign * np.arccos(np.clip(cosine, -1.0, 1.0))
    flexion = np.clip(hinge_sign * bend, 0.0, None)
    end = upper + rotation.rotate(rotation.from_coordinate_axis(0, hinge_sign * flexion), lower)
    # map the local frame (direction of the end, perpendicular hinge axis) to that of the target
    axis = np.broadcast_to(np.array([1.0, 0.0, 0.0]), end.shape)
    turned = rotation.multiply(
        rotation.from_matrix(_direction_frame(target, hinge_sign * np.cross(pole, target))),
        rotation.conjugate(rotation.from_matrix(_direction_frame(end, axis))),
    )
    return turned, flexion


def _direction_frame(direction: Array, axis: Array) -> Array:
    """Return matrices (n, 3, 3) with columns: unit `direction`, `axis` made perpendicular to it, their cross
    product."""
    first = rotation.normalise(direction)
    second = rotation.normalise(axis - np.sum(axis * first, axis=-1, keepdims=True) * first)
    return np.stack([first, second, np.cross(first, second)], axis=-1)
