/**
 * Vectors and frames, in addition to `rotation`: flat arrays (`out` at `outAt`), without allocation. Input and output
 * may be the same array.
 */

import type { Numbers } from "./rotation";

/** Return the dot product of two vectors (3). */
export function dot(a: Numbers, aAt: number, b: Numbers, bAt: number): number {
  return a[aAt] * b[bAt] + a[aAt + 1] * b[bAt + 1] + a[aAt + 2] * b[bAt + 2];
}

/** Return the Euclidean length of a vector (3). */
export function length(a: Numbers, aAt: number): number {
  return Math.sqrt(dot(a, aAt, a, aAt));
}

/** Return the distance between two points (3). */
export function distanceBetween(a: Numbers, aAt: number, b: Numbers, bAt: number): number {
  const x = a[aAt] - b[bAt],
    y = a[aAt + 1] - b[bAt + 1],
    z = a[aAt + 2] - b[bAt + 2];
  return Math.sqrt(x * x + y * y + z * z);
}

/** Write `a` plus `factor` times `b` (3). */
export function addScaled(
  out: Numbers,
  outAt: number,
  a: Numbers,
  aAt: number,
  b: Numbers,
  bAt: number,
  factor: number,
): void {
  for (let i = 0; i < 3; i++) out[outAt + i] = a[aAt + i] + b[bAt + i] * factor;
}

/** Write `factor` times `a` plus `other` times `b` (3). */
export function combine(
  out: Numbers,
  outAt: number,
  a: Numbers,
  aAt: number,
  factor: number,
  b: Numbers,
  bAt: number,
  other: number,
): void {
  for (let i = 0; i < 3; i++) out[outAt + i] = a[aAt + i] * factor + b[bAt + i] * other;
}

/** Write a vector from its components. */
export function setVector(out: Numbers, outAt: number, x: number, y: number, z: number): void {
  out[outAt] = x;
  out[outAt + 1] = y;
  out[outAt + 2] = z;
}

/** Write the cross product, right-handed. */
export function cross(out: Numbers, outAt: number, a: Numbers, aAt: number, b: Numbers, bAt: number): void {
  const ax = a[aAt],
    ay = a[aAt + 1],
    az = a[aAt + 2];
  const bx = b[bAt],
    by = b[bAt + 1],
    bz = b[bAt + 2];
  setVector(out, outAt, ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx);
}

/** Normalise `a`. Return false, and write nothing, if it is not longer than `minLength`. */
export function unit(out: Numbers, outAt: number, a: Numbers, aAt: number, minLength = 1e-12): boolean {
  const size = length(a, aAt);
  if (size <= minLength) return false;
  setVector(out, outAt, a[aAt] / size, a[aAt + 1] / size, a[aAt + 2] / size);
  return true;
}

/** Write the component of `a` perpendicular to the unit vector `axis`. */
export function rejectFrom(out: Numbers, outAt: number, a: Numbers, aAt: number, axis: Numbers, axisAt: number): void {
  const along = dot(a, aAt, axis, axisAt);
  setVector(
    out,
    outAt,
    a[aAt] - axis[axisAt] * along,
    a[aAt + 1] - axis[axisAt + 1] * along,
    a[aAt + 2] - axis[axisAt + 2] * along,
  );
}

/**
 * Write a unit vector perpendicular to the unit vector `axis`: its cross product with x, or with y if it lies along x.
 */
export function anyPerpendicular(out: Numbers, outAt: number, axis: Numbers, axisAt: number): void {
  const x = axis[axisAt],
    y = axis[axisAt + 1],
    z = axis[axisAt + 2];
  if (Math.abs(x) < 0.9) setVector(out, outAt, 0, z, -y);
  else setVector(out, outAt, -z, 0, x);
  unit(out, outAt, out, outAt);
}

/** Normalise a quaternion (4) in place. */
export function normalise(q: Numbers, at: number): void {
  const size = Math.sqrt(q[at] ** 2 + q[at + 1] ** 2 + q[at + 2] ** 2 + q[at + 3] ** 2);
  for (let i = 0; i < 4; i++) q[at + i] /= size;
}

/** Write a rotation by `angle` radians about a coordinate axis: 0, 1, 2 for x, y, z. */
export function fromCoordinateAxis(out: Numbers, outAt: number, axis: 0 | 1 | 2, angle: number): void {
  out[outAt] = Math.cos(0.5 * angle);
  setVector(out, outAt + 1, 0, 0, 0);
  out[outAt + 1 + axis] = Math.sin(0.5 * angle);
}

/** Write a rotation (4) by `angle` radians about the unit vector `axis` (3). */
export function fromAxisAngle(out: Numbers, outAt: number, axis: Numbers, axisAt: number, angle: number): void {
  const s = Math.sin(0.5 * angle);
  const x = axis[axisAt] * s,
    y = axis[axisAt + 1] * s,
    z = axis[axisAt + 2] * s;
  out[outAt] = Math.cos(0.5 * angle);
  setVector(out, outAt + 1, x, y, z);
}

/**
 * Write the shortest rotation (4) from the unit vector `a` to the unit vector `b`; opposite ones rotate about
 * `anyPerpendicular(a)`.
 */
export function rotationBetween(out: Numbers, outAt: number, a: Numbers, aAt: number, b: Numbers, bAt: number): void {
  const w = 1 + dot(a, aAt, b, bAt);
  if (w < 1e-14) {
    anyPerpendicular(out, outAt + 1, a, aAt);
    out[outAt] = 0;
    return;
  }
  cross(out, outAt + 1, a, aAt, b, bAt);
  out[outAt] = w;
  normalise(out, outAt);
}

/** Write the rotation (4) that takes the axes to right-handed unit vectors, nine numbers at `at` (Shepperd 1978). */
export function fromColumns(out: Numbers, outAt: number, c: Numbers, at: number): void {
  const xx = c[at],
    xy = c[at + 1],
    xz = c[at + 2];
  const yx = c[at + 3],
    yy = c[at + 4],
    yz = c[at + 5];
  const zx = c[at + 6],
    zy = c[at + 7],
    zz = c[at + 8];
  const trace = xx + yy + zz;
  if (trace >= Math.max(xx, yy, zz)) {
    out[outAt] = 1 + trace;
    setVector(out, outAt + 1, yz - zy, zx - xz, xy - yx);
  } else if (xx >= Math.max(yy, zz)) {
    out[outAt] = yz - zy;
    setVector(out, outAt + 1, 1 + 2 * xx - trace, xy + yx, xz + zx);
  } else if (yy >= zz) {
    out[outAt] = zx - xz;
    setVector(out, outAt + 1, xy + yx, 1 + 2 * yy - trace, yz + zy);
  } else {
    out[outAt] = xy - yx;
    setVector(out, outAt + 1, xz + zx, yz + zy, 1 + 2 * zz - trace);
  }
  normalise(out, outAt);
}
