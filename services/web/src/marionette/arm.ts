/**
 * The potential-based arm (paper 4), closed exactly. Upper arm, forearm and hand hang in a plane; the table holds where
 * between its limits gravity leaves the wrist bend, and the other joints close on the hand tip.
 *
 * In the plane: x outwards, y up; angles t0, t1, t2 of the links from x towards y, radians; lengths in arm lengths. In
 * space y is up, and the azimuth of the plane is from z (forwards) towards x. The Python room `marionette/arm.py` gives
 * the same numbers.
 */

import type { Numbers } from "../motion/rotation";
import { ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT, innerRadius, type Proportions } from "./proportions";

const SIDE = 64;

/** Bytes of a table as it is served. */
export const TABLE_BYTES = SIDE * SIDE * 2;
/** Numbers that `solve` writes: azimuth, t0, t1, t2, then elbow, wrist and tip. */
export const SOLVED = 13;

/** The table in `bytes` (64 x 64 float16, little-endian). Throws `RangeError` if it is not one. */
export function readTable(bytes: Uint8Array): Float64Array {
  if (bytes.length !== TABLE_BYTES) {
    throw new RangeError(`a table of an arm has ${TABLE_BYTES} bytes, not ${bytes.length}`);
  }
  const table = new Float64Array(SIDE * SIDE);
  for (let i = 0; i < table.length; i++) {
    const bits = bytes[2 * i] | (bytes[2 * i + 1] << 8);
    const exponent = bits >> 10, fraction = (bits & 1023) / 1024;
    const value = exponent === 0 ? fraction * 2 ** -14 : (1 + fraction) * 2 ** (exponent - 15);
    // a sign, an infinity or a NaN is above 1 too
    if (!(value <= 1)) throw new RangeError("a table of an arm has values in 0..1 only");
    table[i] = value;
  }
  return table;
}

function acos(x: number): number {
  return Math.acos(Math.min(Math.max(x, -1), 1));
}

/** One arm's shape and table. */
export class Arm {
  /** The nearest to the shoulder that a hand tip is solved for. */
  readonly inner: number;
  private readonly folded: number;
  private readonly lean: number;
  private readonly angle = new Float64Array(3);
  private readonly limit = new Float64Array(2);

  constructor(readonly proportions: Proportions, private readonly table: Float64Array) {
    this.inner = innerRadius(proportions);
    const { upper, fore } = proportions;
    const x = upper + fore * Math.cos(ELBOW_LIMIT), y = fore * Math.sin(ELBOW_LIMIT);
    this.folded = Math.hypot(x, y);
    this.lean = Math.atan2(y, x);
  }

  /** The nearest distance that is solved for. */
  clamp(r: number): number {
    return Math.min(Math.max(r, this.inner), OUTER_RADIUS);
  }

  /** Least and greatest wrist bend (2), radians, that reach `r` (clamped) with elbow and wrist within their limits. */
  limits(out: Numbers, outAt: number, r: number): void {
    const { upper, fore, hand } = this.proportions;
    const straight = upper + fore, folded = this.folded;
    const high = Math.min(WRIST_LIMIT, acos((r * r - straight * straight - hand * hand) / (2 * straight * hand)));
    const low = this.lean - ELBOW_LIMIT + acos((r * r - folded * folded - hand * hand) / (2 * folded * hand));
    out[outAt] = Math.min(Math.max(low, 0), high);
    out[outAt + 1] = high;
  }

  /** The wrist bend, radians, at which gravity leaves an arm with its tip at (`r`, `beta`), from the table. */
  bend(r: number, beta: number): number {
    const u = (1 - Math.sqrt((1 - r) / (1 - this.inner))) * (SIDE - 1);
    const v = (beta / Math.PI + 0.5) * (SIDE - 1);
    const i = Math.min(Math.max(Math.trunc(u), 0), SIDE - 2), j = Math.min(Math.max(Math.trunc(v), 0), SIDE - 2);
    const p = u - i, q = v - j, at = i * SIDE + j, node = this.table, limit = this.limit;
    const share =
      (node[at] * (1 - q) + node[at + 1] * q) * (1 - p) + (node[at + SIDE] * (1 - q) + node[at + SIDE + 1] * q) * p;
    this.limits(limit, 0, r);
    return limit[0] + share * (limit[1] - limit[0]);
  }

  /**
   * t0, t1, t2 that bring the tip to (`r`, `beta`) with the wrist bent by `bend`, elbow below. Exact for any `bend` within
   * `limits`; beyond them the arm does not reach, or a joint breaks its limit.
   */
  close(out: Numbers, outAt: number, r: number, beta: number, bend: number): void {
    const { upper, fore, hand } = this.proportions;
    const x = fore + hand * Math.cos(bend), y = hand * Math.sin(bend);
    const lower = Math.sqrt(x * x + y * y);
    const t0 = beta - acos((upper * upper + r * r - lower * lower) / (2 * upper * r));
    const t1 = t0 + acos((r * r - upper * upper - lower * lower) / (2 * upper * lower)) - Math.atan2(y, x);
    out[outAt] = t0;
    out[outAt + 1] = t1;
    out[outAt + 2] = t1 + bend;
  }

  /** t0, t1, t2 for a tip at distance `r` (already clamped) and elevation `beta`, -pi/2..pi/2. */
  angles(out: Numbers, outAt: number, r: number, beta: number): void {
    this.close(out, outAt, r, beta, this.bend(r, beta));
  }

  /**
   * The arm whose tip is at (x, y, z), in the vertical plane: `SOLVED` numbers into `out`. A target out of reach is
   * brought in with its direction kept; the shoulder's own place counts as straight below.
   */
  solve(out: Numbers, outAt: number, x: number, y: number, z: number): void {
    const lost = Math.sqrt(x * x + y * y + z * z) < 1e-12;
    const rho = lost ? 0 : Math.sqrt(x * x + z * z), height = lost ? -1e-12 : y;
    const azimuth = lost ? 0 : Math.atan2(x, z);
    const reach = this.clamp(Math.sqrt(rho * rho + height * height));
    const angle = this.angle;
    this.angles(angle, 0, reach, Math.atan2(height, rho));
    const { upper, fore, hand } = this.proportions;
    const east = Math.sin(azimuth), north = Math.cos(azimuth);
    let level = 0, up = 0;
    out[outAt] = azimuth;
    for (let link = 0; link < 3; link++) {
      const size = link === 0 ? upper : link === 1 ? fore : hand;
      level += size * Math.cos(angle[link]);
      up += size * Math.sin(angle[link]);
      out[outAt + 1 + link] = angle[link];
      out[outAt + 4 + 3 * link] = level * east;
      out[outAt + 5 + 3 * link] = up;
      out[outAt + 6 + 3 * link] = level * north;
    }
  }
}
