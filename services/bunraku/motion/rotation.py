"""Rotations as unit quaternions, over whole arrays.

A quaternion is an array (..., 4), order w x y z, and rotates column vectors: `rotate(q, v)` is q v q*. A rotation
vector is an array (..., 3): axis times angle in radians. Frames are right-handed. All functions broadcast over the
leading axes and return float64.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])


def multiply(a: Array, b: Array) -> Array:
    """Return the rotation `b` followed by `a`: (..., 4) times (..., 4) is (..., 4)."""
    aw, ax, ay, az = (a[..., i] for i in range(4))
    bw, bx, by, bz = (b[..., i] for i in range(4))
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def conjugate(q: Array) -> Array:
    """Return the inverse rotation of a unit quaternion (..., 4)."""
    turned: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return turned


def normalise(q: Array) -> Array:
    """Return `q` (..., n) at unit length; a zero vector stays zero."""
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    unit: Array = np.divide(q, length, out=np.zeros_like(q, dtype=np.float64), where=length > 0)
    return unit


def rotate(q: Array, v: Array) -> Array:
    """Rotate the vector `v` (..., 3) by `q` (..., 4)."""
    w, x, y, z = (q[..., i] for i in range(4))
    a, b, c = (v[..., i] for i in range(3))
    # by components: a cross product of whole arrays takes twice as long
    p, r, s = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return np.stack([a + w * p + y * s - z * r, b + w * r + z * p - x * s, c + w * s + x * r - y * p], axis=-1)


def from_rotation_vector(v: Array) -> Array:
    """Return the quaternion (..., 4) of a rotation vector (..., 3) in radians, of any length."""
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    # sin(a/2)/a, by its series below 1e-4, where the quotient would lose digits
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    scale = np.where(small, 0.5 - angle**2 / 48.0, np.sin(0.5 * safe) / safe)
    return np.concatenate([np.cos(0.5 * angle), scale * v], axis=-1)


def to_rotation_vector(q: Array) -> Array:
    """Return the shortest rotation vector (..., 3), of at most pi radians, of a unit quaternion (..., 4)."""
    q = np.where(q[..., :1] < 0, -q, q)
    u = q[..., 1:]
    sine = np.linalg.norm(u, axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    small = sine < 1e-8
    scale = np.where(small, 2.0, angle / np.where(small, 1.0, sine))
    vector: Array = scale * u
    return vector


def to_axis_angle(q: Array) -> Array:
    """Return axis and angle (..., 4): unit axis x y z and angle in 0..pi, the form of the paper's channels (paper 2).

    Without rotation the axis is y.
    """
    v = to_rotation_vector(q)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    still = angle < 1e-12
    axis = np.where(still, np.array([0.0, 1.0, 0.0]), v / np.where(still, 1.0, angle))
    return np.concatenate([axis, angle], axis=-1)


def from_axis_angle(a: Array) -> Array:
    """Return the quaternion (..., 4) of a unit axis and an angle in radians (..., 4)."""
    return from_rotation_vector(a[..., :3] * a[..., 3:])


def from_coordinate_axis(axis: int, angle: Array) -> Array:
    """Return the quaternion (..., 4) of a rotation by `angle` (...) radians about x, y or z (`axis` 0, 1, 2)."""
    angle = np.asarray(angle, dtype=np.float64)
    q = np.zeros((*angle.shape, 4))
    q[..., 0] = np.cos(0.5 * angle)
    q[..., 1 + axis] = np.sin(0.5 * angle)
    return q


def rotation_between(a: Array, b: Array) -> Array:
    """Return the shortest rotation (..., 4) that brings the direction of `a` (..., 3) to that of `b`.

    Opposite directions rotate about an axis perpendicular to `a`; a zero vector gives the identity.
    """
    a, b = np.broadcast_arrays(normalise(np.asarray(a, dtype=np.float64)), normalise(np.asarray(b, dtype=np.float64)))
    dot = np.sum(a * b, axis=-1, keepdims=True)
    opposite = dot < -1.0 + 1e-14
    square = np.where(np.abs(a[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    axis = np.where(opposite, normalise(np.cross(a, square)), np.cross(a, b))
    q = normalise(np.concatenate([np.where(opposite, 0.0, 1.0 + dot), axis], axis=-1))
    moving = (np.linalg.norm(a, axis=-1, keepdims=True) > 0) & (np.linalg.norm(b, axis=-1, keepdims=True) > 0)
    return np.where(moving, q, IDENTITY)


def from_matrix(m: Array) -> Array:
    """Return the quaternion (..., 4) of rotation matrices (..., 3, 3) (Shepperd 1978: largest component first)."""
    t = np.trace(m, axis1=-2, axis2=-1)
    d = np.stack([t, m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]], axis=-1)
    which = np.argmax(d, axis=-1)
    q = np.empty((*m.shape[:-2], 4))
    x = np.stack([m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]], axis=-1)
    s = m + np.swapaxes(m, -1, -2)
    q[..., 0] = np.where(which == 0, 1.0 + t, np.take_along_axis(x, np.maximum(which - 1, 0)[..., None], -1)[..., 0])
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        q[..., 1 + i] = np.select(
            [which == 0, which == 1 + i, which == 1 + j],
            [x[..., i], 1.0 + 2.0 * m[..., i, i] - t, s[..., i, j]],
            s[..., i, k],
        )
    return normalise(q)


def to_matrix(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4); columns are the rotated axes."""
    columns = [rotate(q, np.eye(3)[i]) for i in range(3)]
    return np.stack(columns, axis=-1)


def slerp(a: Array, b: Array, t: Array | float) -> Array:
    """Interpolate from `a` (..., 4) at t = 0 to `b` at t = 1 by the shorter arc, at constant speed; `t` (...)."""
    t = np.asarray(t, dtype=np.float64)
    return multiply(a, from_rotation_vector(to_rotation_vector(multiply(conjugate(a), b)) * t[..., None]))


def unwrap_rotation_vectors(v: Array) -> Array:
    """Return rotation vectors (n, ..., 3) of the same rotations, each the equivalent nearest to the previous one.

    A rotation vector may be lengthened by any multiple of 2 pi along its axis; choosing the nearest avoids jumps at pi,
    which a transform would have to code.
    """
    out = np.array(v, dtype=np.float64)
    for i in range(1, len(out)):
        here, before = out[i], out[i - 1]
        angle = np.linalg.norm(here, axis=-1, keepdims=True)
        # without rotation the axis is arbitrary: keep the previous one
        axis = np.where(angle > 1e-9, here / np.where(angle > 1e-9, angle, 1.0), normalise(before))
        along = np.sum(axis * before, axis=-1, keepdims=True)
        turns = np.round((along - angle) / (2.0 * np.pi))
        out[i] = here + axis * turns * (2.0 * np.pi)
    return out
