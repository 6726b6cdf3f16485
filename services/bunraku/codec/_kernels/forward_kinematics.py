"""Forward kinematics: from the coefficients of a block to the world positions of joints and tips.

Arrays of a block start with the joint: orientations (18, n, 4), points (23, n, 3), joints first and then the tips in
the order of `TIP_JOINTS`. World frame, metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bunraku.codec._kernels.rotation import apply_matrix, from_rotation_vector, multiply, rotate
from bunraku.codec.block_input import KinematicChain, Quantiser
from bunraku.codec.prior import IntArray
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, PARENTS, TIP_JOINTS

PARENT: IntArray = np.array(PARENTS, dtype=np.int64)
TIP_OF: IntArray = np.array(
    [TIP_JOINTS.index(k) if k in TIP_JOINTS else -1 for k in range(JOINT_COUNT)], dtype=np.int64
)
"""Tip of each joint, -1 if it has none."""
POINT_COUNT = JOINT_COUNT + len(TIP_JOINTS)


def _pad_lists(rows: list[list[int]]) -> tuple[IntArray, IntArray]:
    """Return lists of different lengths as a table padded with -1, and their lengths."""
    table = np.full((len(rows), max(map(len, rows))), -1, dtype=np.int64)
    for row, values in enumerate(rows):
        table[row, : len(values)] = values
    return table, np.array([len(row) for row in rows], dtype=np.int64)


def _descendants(joint: int) -> list[int]:
    found = [joint]
    for k in range(joint + 1, JOINT_COUNT):
        if PARENTS[k] in found:
            found.append(k)
    return found


CHILDREN, CHILD_COUNT = _pad_lists(
    [[k for k in range(JOINT_COUNT) if PARENTS[k] == joint] for joint in range(JOINT_COUNT)]
)
DESCENDANTS, DESCENDANT_COUNT = _pad_lists([_descendants(joint) for joint in range(JOINT_COUNT)])
"""Joints that turn with each joint, itself first."""
MOVED_POINTS, MOVED_POINT_COUNT = _pad_lists(
    [
        _descendants(joint)[1:] + [JOINT_COUNT + TIP_JOINTS.index(k) for k in _descendants(joint) if k in TIP_JOINTS]
        for joint in range(JOINT_COUNT)
    ]
)
"""Points that move if a joint turns."""


class Pose(NamedTuple):
    """Poses of all frames of a block: `vectors` (18, n, 3) are the rotation vectors of the joints' channels,
    `orientation` (18, n, 4) and `points` (23, n, 3) are in the world frame."""

    vectors: Array
    orientation: Array
    points: Array


@njit(cache=True)
def create_pose(frames: int) -> Pose:
    """Allocate the poses of a block."""
    return Pose(
        np.zeros((JOINT_COUNT, frames, 3)), np.zeros((JOINT_COUNT, frames, 4)), np.zeros((POINT_COUNT, frames, 3))
    )


@njit(cache=True, inline="always")
def reconstruct(q: int) -> float:
    """Return the value of a quantised coefficient in steps.

    It lies a little below the middle of the quantiser's interval, because smaller values are more frequent.
    """
    if q == 0:
        return 0.0
    magnitude = abs(q)
    value = magnitude - 0.06 if magnitude == 1 else magnitude - 0.03
    return value if q > 0 else -value


@njit(cache=True)
def project_onto_basis(basis: Array, values: Array) -> Array:
    """Return the coefficients (K, 3) of `values` (n, 3) over the rows of `basis` (K, n).

    Written out, because numba's own matrix product needs SciPy.
    """
    coefficients = np.zeros((basis.shape[0], 3))
    for k in range(basis.shape[0]):
        for t in range(basis.shape[1]):
            for x in range(3):
                coefficients[k, x] += basis[k, t] * values[t, x]
    return coefficients


@njit(cache=True)
def evaluate_channel(chain: KinematicChain, quantiser: Quantiser, q: IntArray, channel: int) -> Array:
    """Return the values (n, 3) of one channel of the coefficients `q` (19, 3, K)."""
    basis, inverse_weight = quantiser.basis, chain.inverse_weight[channel]
    values = np.zeros((basis.shape[1], 3))
    weighted, coefficient = np.zeros(3), np.zeros(3)
    for k in range(basis.shape[0]):
        if q[channel, 0, k] == 0 and q[channel, 1, k] == 0 and q[channel, 2, k] == 0:
            continue
        for axis in range(3):
            weighted[axis] = reconstruct(q[channel, axis, k]) * quantiser.step_size
        apply_matrix(inverse_weight, weighted, coefficient)
        for t in range(basis.shape[1]):
            for x in range(3):
                values[t, x] += basis[k, t] * coefficient[x]
    return values


@njit(cache=True)
def place_child_points(chain: KinematicChain, joint: int, pose: Pose) -> None:
    """Compute the positions of a joint's children and tip from its position and orientation."""
    orientation, points = pose.orientation, pose.points
    v = np.zeros(3)
    for i in range(CHILD_COUNT[joint] + 1):
        if i < CHILD_COUNT[joint]:
            child = CHILDREN[joint, i]
            arm = chain.offsets[child]
        elif TIP_OF[joint] >= 0:
            child = 18 + TIP_OF[joint]
            arm = chain.tips[joint]
        else:
            break
        for t in range(orientation.shape[1]):
            rotate(orientation[joint, t], arm, v)
            for x in range(3):
                points[child, t, x] = points[joint, t, x] + v[x]


@njit(cache=True)
def compute_orientation(chain: KinematicChain, joint: int, vectors: Array, pose: Pose) -> None:
    """Compute a joint's world orientation from its rotation vectors (n, 3) and its parent's orientation."""
    parent, orientation, q = PARENT[joint], pose.orientation, np.zeros(4)
    for t in range(len(vectors)):
        from_rotation_vector(vectors[t], q)
        if parent < 0:
            multiply(chain.reference[joint], q, orientation[joint, t])
        else:
            multiply(chain.reference[joint], q, q)
            multiply(orientation[parent, t], q, orientation[joint, t])


@njit(cache=True)
def compute_pose(chain: KinematicChain, quantiser: Quantiser, q: IntArray, pose: Pose) -> None:
    """Decode the coefficients `q` (19, 3, K) into `pose`."""
    pose.points[0] = evaluate_channel(chain, quantiser, q, 0)
    for joint in range(18):
        pose.vectors[joint] = evaluate_channel(chain, quantiser, q, joint + 1)
        compute_orientation(chain, joint, pose.vectors[joint], pose)
        place_child_points(chain, joint, pose)


@njit(cache=True, nogil=True)
def compute_points(chain: KinematicChain, quantiser: Quantiser, q: IntArray) -> Array:
    """Decode the coefficients `q` (19, 3, K) to world points (23, n, 3)."""
    pose = create_pose(quantiser.basis.shape[1])
    compute_pose(chain, quantiser, q, pose)
    return pose.points
