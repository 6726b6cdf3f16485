"""Rotations of one joint at one frame. Quaternions are w, x, y, z; results are written into `out`."""

from __future__ import annotations

import numpy as np
from numba import njit

from bunraku.motion.rotation import Array


@njit(cache=True, inline="always")
def multiply(a: Array, b: Array, out: Array) -> None:
    """Compute the rotation `b` followed by `a`. `out` may be either of them."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    out[0], out[1], out[2], out[3] = w, x, y, z


@njit(cache=True, inline="always")
def multiply_inverse(a: Array, b: Array, out: Array) -> None:
    """Compute the rotation `b` followed by the inverse of `a`. `out` may be either of them."""
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    x = a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]
    y = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    out[0], out[1], out[2], out[3] = w, x, y, z


@njit(cache=True, inline="always")
def rotate(q: Array, v: Array, out: Array) -> None:
    """Rotate the vector `v` by `q`. `out` may be `v`."""
    tx = 2 * (q[2] * v[2] - q[3] * v[1])
    ty = 2 * (q[3] * v[0] - q[1] * v[2])
    tz = 2 * (q[1] * v[1] - q[2] * v[0])
    x = v[0] + q[0] * tx + q[2] * tz - q[3] * ty
    y = v[1] + q[0] * ty + q[3] * tx - q[1] * tz
    z = v[2] + q[0] * tz + q[1] * ty - q[2] * tx
    out[0], out[1], out[2] = x, y, z


@njit(cache=True, inline="always")
def from_rotation_vector(v: Array, out: Array) -> None:
    """Convert the rotation vector `v` to a quaternion."""
    angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    s = 0.5 - angle * angle / 48 if angle < 1e-4 else np.sin(angle / 2) / angle
    out[0], out[1], out[2], out[3] = np.cos(angle / 2), v[0] * s, v[1] * s, v[2] * s


@njit(cache=True, inline="always")
def to_rotation_vector(q: Array, out: Array) -> None:
    """Convert the quaternion `q` to its shortest rotation vector."""
    sign = 1.0 if q[0] >= 0 else -1.0
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    s = sign * (2.0 if sine < 1e-9 else 2 * np.arctan2(sine, sign * q[0]) / sine)
    out[0], out[1], out[2] = q[1] * s, q[2] * s, q[3] * s


@njit(cache=True, inline="always")
def apply_matrix(m: Array, v: Array, out: Array) -> None:
    """Multiply the matrix `m` (3, 3) and the vector `v`. `out` must not be `v`."""
    for i in range(3):
        out[i] = m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2]
