"""The figure as compiled code walks it: rotations, chains, and a block's coefficients to where its points are.

Quaternions are w x y z; arrays of a block lead with the joint: orientations (18, n, 4), points (23, n, 3), joints first
and then the tips in the order of `TIPS`. World frame, metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from bunraku.codec.prior import IntArray
from bunraku.motion.skeleton import JOINT_COUNT, PARENTS, TIP_JOINTS

Array = npt.NDArray[np.float64]

PARENT: IntArray = np.array(PARENTS, dtype=np.int64)
TIP_OF: IntArray = np.array(
    [TIP_JOINTS.index(k) if k in TIP_JOINTS else -1 for k in range(JOINT_COUNT)], dtype=np.int64
)
POINT_COUNT = JOINT_COUNT + len(TIP_JOINTS)


def _pad_lists(rows: list[list[int]]) -> tuple[IntArray, IntArray]:
    """Ragged lists as a table filled up with -1, and how long each is."""
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
"""Points that move when each joint turns."""


class KinematicChain(NamedTuple):
    """One dancer in one block: `offsets`, `tips` (18, 3); `weight` and `unweight` (19, 3, 3), what brings a channel's
    values to the scale of the quantiser and back; `reference` (18, 4), what each joint's rotations are relative to."""

    offsets: Array
    tips: Array
    weight: Array
    inverse_weight: Array
    reference: Array


@njit(cache=True, inline="always")
def multiply(a: Array, b: Array, out: Array) -> None:
    """`out` = the rotation `b` followed by `a`; `out` may be either."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    out[0], out[1], out[2], out[3] = w, x, y, z


@njit(cache=True, inline="always")
def multiply_inverse(a: Array, b: Array, out: Array) -> None:
    """`out` = `b` followed by the opposite of `a`."""
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]
    y = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    out[0], out[1], out[2], out[3] = w, x, y, z


@njit(cache=True, inline="always")
def rotate(q: Array, v: Array, out: Array) -> None:
    """`out` = `v` turned by `q`; `out` may be `v`."""
    tx = 2 * (q[2] * v[2] - q[3] * v[1])
    ty = 2 * (q[3] * v[0] - q[1] * v[2])
    tz = 2 * (q[1] * v[1] - q[2] * v[0])
    x = v[0] + q[0] * tx + q[2] * tz - q[3] * ty
    y = v[1] + q[0] * ty + q[3] * tx - q[1] * tz
    z = v[2] + q[0] * tz + q[1] * ty - q[2] * tx
    out[0], out[1], out[2] = x, y, z


@njit(cache=True, inline="always")
def from_rotation_vector(v: Array, out: Array) -> None:
    """`out` = the rotation of the rotation vector `v`."""
    angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    s = 0.5 - angle * angle / 48 if angle < 1e-4 else np.sin(angle / 2) / angle
    out[0], out[1], out[2], out[3] = np.cos(angle / 2), v[0] * s, v[1] * s, v[2] * s


@njit(cache=True, inline="always")
def to_rotation_vector(q: Array, out: Array) -> None:
    """`out` = the shortest rotation vector of `q`."""
    sign = 1.0 if q[0] >= 0 else -1.0
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    s = sign * (2.0 if sine < 1e-9 else 2 * np.arctan2(sine, sign * q[0]) / sine)
    out[0], out[1], out[2] = q[1] * s, q[2] * s, q[3] * s


@njit(cache=True, inline="always")
def apply_matrix(m: Array, v: Array, out: Array) -> None:
    """`out` = the matrix (3, 3) times `v`; not in place."""
    for i in range(3):
        out[i] = m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2]


@njit(cache=True, inline="always")
def reconstruct(q: int) -> float:
    """The value of a quantised coefficient, in steps: a little below its middle, where values are denser."""
    if q == 0:
        return 0.0
    size = abs(q)
    size_at = size - 0.06 if size == 1 else size - 0.03
    return size_at if q > 0 else -size_at


@njit(cache=True)
def project_onto_basis(basis: Array, v: Array) -> Array:
    """The coefficients (K, 3) of values `v` (n, 3) over the rows of `basis` (K, n). Written out, as numba's own product
    of matrices asks for SciPy."""
    found = np.zeros((basis.shape[0], 3))
    for k in range(basis.shape[0]):
        for t in range(basis.shape[1]):
            for x in range(3):
                found[k, x] += basis[k, t] * v[t, x]
    return found


@njit(cache=True)
def evaluate_channel(q: IntArray, channel: int, step_size: float, inverse_weight: Array, basis: Array) -> Array:
    """The values (n, 3) of a channel with coefficients `q` (19, 3, K) at steps of `size`, over the rows of `basis`
    (K, n)."""
    found = np.zeros((basis.shape[1], 3))
    v, coefficient = np.zeros(3), np.zeros(3)
    for k in range(basis.shape[0]):
        for axis in range(3):
            v[axis] = reconstruct(q[channel, axis, k]) * step_size
        apply_matrix(inverse_weight, v, coefficient)
        for t in range(basis.shape[1]):
            for x in range(3):
                found[t, x] += basis[k, t] * coefficient[x]
    return found


@njit(cache=True)
def place_child_points(chain: KinematicChain, joint: int, orientation: Array, points: Array) -> None:
    """The points right below a joint, its tip too, once its own `orientation` (18, n, 4) and place are known."""
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
def compute_orientation(chain: KinematicChain, joint: int, vectors: Array, orientation: Array) -> None:
    """The joint's world orientation from its rotation vectors (n, 3) and its parent's orientation."""
    parent, q = PARENT[joint], np.zeros(4)
    for t in range(len(vectors)):
        from_rotation_vector(vectors[t], q)
        if parent < 0:
            multiply(chain.reference[joint], q, orientation[joint, t])
        else:
            multiply(chain.reference[joint], q, q)
            multiply(orientation[parent, t], q, orientation[joint, t])


@njit(cache=True)
def compute_pose(
    chain: KinematicChain,
    q: IntArray,
    step_size: float,
    basis: Array,
    vectors: Array,
    orientation: Array,
    points: Array,
) -> None:
    """All of a block: `vectors` (18, n, 3), `orientation` (18, n, 4) and `points` (23, n, 3) of coefficients `q`."""
    points[0] = evaluate_channel(q, 0, step_size, chain.inverse_weight[0], basis)
    for joint in range(18):
        vectors[joint] = evaluate_channel(q, joint + 1, step_size, chain.inverse_weight[joint + 1], basis)
        compute_orientation(chain, joint, vectors[joint], orientation)
        place_child_points(chain, joint, orientation, points)


@njit(cache=True, nogil=True)
def compute_points(chain: KinematicChain, q: IntArray, step_size: float, basis: Array) -> Array:
    """Only the points (23, n, 3) of a block."""
    frames = basis.shape[1]
    found = np.zeros((23, frames, 3))
    compute_pose(chain, q, step_size, basis, np.zeros((18, frames, 3)), np.zeros((18, frames, 4)), found)
    return found
