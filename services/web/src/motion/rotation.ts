/**
 * Rotations as unit quaternions, w x y z, in flat arrays; they act on column vectors. Every function writes into `out`
 * at `outAt` and may use the same array for input and output, so that a frame is drawn without allocation. Names and
 * conventions are those of `motion/rotation.py` in Python.
 */

export type Numbers = Float64Array;

/** Multiply: the rotation `b` followed by `a`. */
export function multiply(out: Numbers, outAt: number, a: Numbers, aAt: number, b: Numbers, bAt: number): void {
  const aw = a[aAt],
    ax = a[aAt + 1],
    ay = a[aAt + 2],
    az = a[aAt + 3];
  const bw = b[bAt],
    bx = b[bAt + 1],
    by = b[bAt + 2],
    bz = b[bAt + 3];
  out[outAt] = aw * bw - ax * bx - ay * by - az * bz;
  out[outAt + 1] = aw * bx + ax * bw + ay * bz - az * by;
  out[outAt + 2] = aw * by - ax * bz + ay * bw + az * bx;
  out[outAt + 3] = aw * bz + ax * by - ay * bx + az * bw;
}

/** Invert a rotation. */
export function conjugate(out: Numbers, outAt: number, q: Numbers, qAt: number): void {
  out[outAt] = q[qAt];
  out[outAt + 1] = -q[qAt + 1];
  out[outAt + 2] = -q[qAt + 2];
  out[outAt + 3] = -q[qAt + 3];
}

/** Rotate the vector `v` (3) by the quaternion `q`. */
export function rotate(out: Numbers, outAt: number, q: Numbers, qAt: number, v: Numbers, vAt: number): void {
  const w = q[qAt],
    x = q[qAt + 1],
    y = q[qAt + 2],
    z = q[qAt + 3];
  const a = v[vAt],
    b = v[vAt + 1],
    c = v[vAt + 2];
  const tx = 2 * (y * c - z * b),
    ty = 2 * (z * a - x * c),
    tz = 2 * (x * b - y * a);
  out[outAt] = a + w * tx + y * tz - z * ty;
  out[outAt + 1] = b + w * ty + z * tx - x * tz;
  out[outAt + 2] = c + w * tz + x * ty - y * tx;
}

/** Convert to a matrix [3][3] (nine numbers); its columns are the rotated axes. */
export function toMatrix(out: Numbers, outAt: number, q: Numbers, qAt: number): void {
  const w = q[qAt],
    x = q[qAt + 1],
    y = q[qAt + 2],
    z = q[qAt + 3];
  out[outAt] = 1 - 2 * (y * y + z * z);
  out[outAt + 1] = 2 * (x * y - w * z);
  out[outAt + 2] = 2 * (x * z + w * y);
  out[outAt + 3] = 2 * (x * y + w * z);
  out[outAt + 4] = 1 - 2 * (x * x + z * z);
  out[outAt + 5] = 2 * (y * z - w * x);
  out[outAt + 6] = 2 * (x * z - w * y);
  out[outAt + 7] = 2 * (y * z + w * x);
  out[outAt + 8] = 1 - 2 * (x * x + y * y);
}

/** Convert from a rotation vector (axis times angle in radians, of any length). */
export function fromRotationVector(out: Numbers, outAt: number, x: number, y: number, z: number): void {
  const angle = Math.sqrt(x * x + y * y + z * z);
  // sin(a/2)/a, by its series where the quotient would lose digits.
  const scale = angle < 1e-4 ? 0.5 - (angle * angle) / 48 : Math.sin(0.5 * angle) / angle;
  out[outAt] = Math.cos(0.5 * angle);
  out[outAt + 1] = scale * x;
  out[outAt + 2] = scale * y;
  out[outAt + 3] = scale * z;
}

/** Convert a unit quaternion to its shortest rotation vector (3), at most pi radians long. */
export function toRotationVector(out: Numbers, outAt: number, q: Numbers, qAt: number): void {
  const sign = q[qAt] < 0 ? -1 : 1;
  const x = q[qAt + 1],
    y = q[qAt + 2],
    z = q[qAt + 3];
  const sine = Math.sqrt(x * x + y * y + z * z);
  const scale = sign * (sine < 1e-8 ? 2 : (2 * Math.atan2(sine, sign * q[qAt])) / sine);
  out[outAt] = scale * x;
  out[outAt + 1] = scale * y;
  out[outAt + 2] = scale * z;
}

/** Interpolate from `a` at t = 0 to `b` at t = 1 by the shorter way, at constant angular speed. */
export function slerp(out: Numbers, outAt: number, a: Numbers, aAt: number, b: Numbers, bAt: number, t: number): void {
  let dot = a[aAt] * b[bAt] + a[aAt + 1] * b[bAt + 1] + a[aAt + 2] * b[bAt + 2] + a[aAt + 3] * b[bAt + 3];
  const sign = dot < 0 ? -1 : 1;
  dot *= sign;
  let u = 1 - t,
    v = t;
  // Nearly the same rotation: linear interpolation differs by less than rounding, and the sine below would be zero.
  if (dot < 1 - 1e-12) {
    const angle = Math.acos(dot),
      sine = Math.sin(angle);
    u = Math.sin(u * angle) / sine;
    v = Math.sin(t * angle) / sine;
  }
  v *= sign;
  for (let i = 0; i < 4; i++) out[outAt + i] = u * a[aAt + i] + v * b[bAt + i];
}
