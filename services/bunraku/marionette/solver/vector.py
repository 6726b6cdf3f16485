"""Vectors and unit quaternions of one limb, as plain tuples of floats.

The conventions are those of `motion.rotation` (w x y z, column vectors). A stage solves one limb at a time; for so few
numbers an array library costs about twenty times more than the arithmetic.
"""

from __future__ import annotations

from math import acos, atan2, cos, sin, sqrt

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

JointRotations = tuple[Quaternion, Quaternion, Quaternion]
"""Local rotations of shoulder, elbow and wrist, or of hip, knee and ankle."""

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)
ZERO: Vector = (0.0, 0.0, 0.0)


def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vector, factor: float) -> Vector:
    """Return `a` times a number."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the right-handed vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a: Vector) -> float:
    """Return the Euclidean length."""
    return sqrt(dot(a, a))


def unit(a: Vector, fallback: Vector) -> Vector:
    """Return `a` scaled to unit length, or `fallback` if `a` is shorter than 1e-12."""
    size = length(a)
    return scale(a, 1.0 / size) if size > 1e-12 else fallback


def reject_from(a: Vector, axis: Vector) -> Vector:
    """Return the part of `a` perpendicular to the unit vector `axis`."""
    return subtract(a, scale(axis, dot(a, axis)))


def any_perpendicular(axis: Vector) -> Vector:
    """Return a unit vector perpendicular to the unit vector `axis`."""
    seed = (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0)
    return unit(cross(axis, seed), seed)


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation `b` followed by `a`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Return the inverse rotation."""
    return (q[0], -q[1], -q[2], -q[3])


def normalise(q: Quaternion) -> Quaternion:
    """Return `q` scaled to unit length; the identity for zero."""
    size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] / size, q[1] / size, q[2] / size, q[3] / size) if size > 0.0 else IDENTITY


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return the vector `v` rotated by `q`."""
    w, x, y, z = q
    a, b, c = v
    p, r, s = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return (a + w * p + y * s - z * r, b + w * r + z * p - x * s, c + w * s + x * r - y * p)


def from_axis_angle(axis: Vector, angle: float) -> Quaternion:
    """Return the rotation by `angle` radians about the unit vector `axis`."""
    s = sin(0.5 * angle)
    return (cos(0.5 * angle), axis[0] * s, axis[1] * s, axis[2] * s)


def about_z(angle: float) -> Quaternion:
    """Return the rotation by `angle` radians about the z axis."""
    return from_axis_angle((0.0, 0.0, 1.0), angle)


def rotation_between(a: Vector, b: Vector) -> Quaternion:
    """Return the shortest rotation from the unit vector `a` to the unit vector `b`.

    The rotation between opposite vectors is about `any_perpendicular(a)`.
    """
    w = 1.0 + dot(a, b)
    if w < 1e-14:
        return from_axis_angle(any_perpendicular(a), 3.141592653589793)
    x, y, z = cross(a, b)
    return normalise((w, x, y, z))


def from_columns(x: Vector, y: Vector, z: Vector) -> Quaternion:
    """Return the rotation that maps the axes to the right-handed unit vectors `x`, `y`, `z` (Shepperd 1978)."""
    trace = x[0] + y[1] + z[2]
    if trace >= max(x[0], y[1], z[2]):
        q = (1.0 + trace, y[2] - z[1], z[0] - x[2], x[1] - y[0])
    elif x[0] >= max(y[1], z[2]):
        q = (y[2] - z[1], 1.0 + 2.0 * x[0] - trace, x[1] + y[0], x[2] + z[0])
    elif y[1] >= z[2]:
        q = (z[0] - x[2], x[1] + y[0], 1.0 + 2.0 * y[1] - trace, y[2] + z[1])
    else:
        q = (x[1] - y[0], x[2] + z[0], y[2] + z[1], 1.0 + 2.0 * z[2] - trace)
    return normalise(q)


def scale_rotation(q: Quaternion, fraction: float) -> Quaternion:
    """Return the rotation about the axis of `q` by a fraction of its angle.

    The angle is up to 2 pi: `q` and -`q` turn in opposite directions.
    """
    axis = (q[1], q[2], q[3])
    half = atan2(length(axis), q[0])
    return from_axis_angle(unit(axis, (1.0, 0.0, 0.0)), 2.0 * half * fraction)


def slerp(a: Quaternion, b: Quaternion, t: float) -> Quaternion:
    """Interpolate from `a` at t = 0 to `b` at t = 1, the shorter way and at constant angular speed."""
    d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = -1.0 if d < 0.0 else 1.0
    d = min(1.0, d * sign)
    if d > 1.0 - 1e-9:
        u, v = 1.0 - t, t * sign
    else:
        angle = acos(d)
        u, v = sin((1.0 - t) * angle) / sin(angle), sin(t * angle) / sin(angle) * sign
    return normalise((a[0] * u + b[0] * v, a[1] * u + b[1] * v, a[2] * u + b[2] * v, a[3] * u + b[3] * v))
