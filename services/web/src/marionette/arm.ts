/**
 * The potential-based arm (paper 4), closed exactly. Upper arm, forearm and hand hang in a plane; the table holds where
 * between its limits gravity leaves the wrist bend, and the other joints close on the hand tip.
 *
 * In the plane: x outwards, y up; angles t0, t1, t2 of the links from x towards y, radians; lengths in arm lengths. In
 * space y is up, and the azimuth of the plane is from z (forwards) towards x. The Python rooms `marionette/arm.py` (angles)
 * and `marionette/arms.py` (places) give the same numbers.
 */

import type { Numbers } from "../motion/rotation";
import { ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT, innerRadius, type Proportions } from "./proportions";

const SIDE = 64;
/** Sine of half the wrist's limit. */
const WIDEST = Math.sin(WRIST_LIMIT / 2);
/** A target nearer to the shoulder than this has no direction to keep. */
const NOWHERE = 1e-12;
/** A level distance is 0 below this: far under any that matters, far above where a square loses digits. */
const ON_AXIS = 1e-150;

/** Bytes of a table as it is served. */
export const TABLE_BYTES = SIDE * SIDE * 2;
/** Numbers that `solve` writes: sine and cosine of the azimuth, then elbow, wrist and tip. */
export const SOLVED = 11;

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
  private readonly rows: number;
  /** With the elbow straight, and with it bent to its limit: 1 / (4 x distance of the wrist x hand). */
  private readonly straight: number;
  private readonly folded: number;
  /** The bent elbow: distance of the wrist, and the angle from the line to it to the forearm (negative). */
  private readonly distance: number;
  private readonly lean: number;
  private readonly leanSine: number;
  private readonly leanCosine: number;
  /** Squares of the nearest and the farthest that this elbow reaches, and of where it does with the wrist straight. */
  private readonly near: number;
  private readonly far: number;
  private readonly fold: number;
  private readonly limit = new Float64Array(2);

  constructor(readonly proportions: Proportions, private readonly table: Float64Array) {
    const { upper, fore, hand } = proportions;
    this.inner = innerRadius(proportions);
    this.rows = 1 / (1 - this.inner);
    const x = upper + fore * Math.cos(ELBOW_LIMIT), y = fore * Math.sin(ELBOW_LIMIT);
    const distance = (this.distance = Math.hypot(x, y));
    this.lean = Math.atan2(y, x) - ELBOW_LIMIT;
    this.leanSine = Math.sin(this.lean / 2);
    this.leanCosine = Math.cos(this.lean / 2);
    this.straight = 1 / (4 * (upper + fore) * hand);
    this.folded = 1 / (4 * distance * hand);
    this.near = (distance - hand) ** 2;
    this.far = (distance + hand) ** 2;
    this.fold = distance * distance + hand * hand + 2 * distance * hand * Math.cos(this.lean);
  }

  /** The nearest distance that is solved for. */
  clamp(r: number): number {
    return Math.min(Math.max(r, this.inner), OUTER_RADIUS);
  }

  /** Least and greatest wrist bend (2), radians, that reach `r` (clamped) with elbow and wrist within their limits. */
  limits(out: Numbers, outAt: number, r: number): void {
    const { upper, fore, hand } = this.proportions;
    const straight = upper + fore, folded = this.distance;
    const high = Math.min(WRIST_LIMIT, acos((r * r - straight * straight - hand * hand) / (2 * straight * hand)));
    const low = this.lean + acos((r * r - folded * folded - hand * hand) / (2 * folded * hand));
    out[outAt] = Math.min(Math.max(low, 0), high);
    out[outAt + 1] = high;
  }

  /** The wrist bend, radians, at which gravity leaves an arm with its tip at (`r`, `beta`), from the table. */
  bend(r: number, beta: number): number {
    const { limit } = this;
    this.limits(limit, 0, r);
    const least = Math.sin(limit[0] / 2), greatest = Math.sin(limit[1] / 2);
    return 2 * Math.asin(least + this.share(r, Math.cos(beta), Math.sin(beta)) * (greatest - least));
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
   *
   * Square roots alone: a place in the plane is a complex number, and joints turn by multiplying.
   */
  solve(out: Numbers, outAt: number, x: number, y: number, z: number): void {
    const { upper, fore, hand } = this.proportions;
    const flat = x * x + z * z;
    let level = Math.sqrt(flat), up = y, reach = Math.sqrt(flat + y * y);
    if (reach < NOWHERE) {
      level = 0;
      up = -NOWHERE;
      reach = NOWHERE;
    }
    const off = level >= ON_AXIS, sine = off ? x / level : 0, cosine = off ? z / level : 1;
    const r = Math.min(Math.max(reach, this.inner), OUTER_RADIUS), square = r * r;
    const share = this.share(r, level, up);
    const greatest = Math.min(WIDEST, Math.sqrt((1 - square) * this.straight));
    let least = 0;
    if (square < this.fold) {
      // half of an angle sum: the folded elbow's lean, and the bend that reaches r from there
      const bendSine = Math.sqrt(Math.min((this.far - square) * this.folded, 1));
      const bendCosine = Math.sqrt(Math.max((square - this.near) * this.folded, 0));
      least = Math.min(Math.max(this.leanSine * bendCosine + this.leanCosine * bendSine, 0), greatest);
    }
    const half = least + share * (greatest - least);
    const cosBend = 1 - 2 * half * half, sinBend = 2 * half * Math.sqrt(1 - half * half);
    // the rest of the arm, seen along the forearm, and the triangle it makes with the upper arm
    const restX = fore + hand * cosBend, restY = hand * sinBend, rest = restX * restX + restY * restY;
    const along = ((upper * upper + square - rest) * 0.5) / square;
    const below = Math.sqrt(Math.max((upper * upper) / square - along * along, 0));
    const scale = r / reach;
    level *= scale;
    up *= scale;
    const elbowX = level * along + up * below, elbowY = up * along - level * below;
    const chordX = (level - elbowX) / rest, chordY = (up - elbowY) / rest;
    const foreX = chordX * restX + chordY * restY, foreY = chordY * restX - chordX * restY;
    const wristX = elbowX + fore * foreX, wristY = elbowY + fore * foreY;
    const tipX = wristX + hand * (foreX * cosBend - foreY * sinBend);
    const tipY = wristY + hand * (foreY * cosBend + foreX * sinBend);
    out[outAt] = sine;
    out[outAt + 1] = cosine;
    out[outAt + 2] = elbowX * sine;
    out[outAt + 3] = elbowY;
    out[outAt + 4] = elbowX * cosine;
    out[outAt + 5] = wristX * sine;
    out[outAt + 6] = wristY;
    out[outAt + 7] = wristX * cosine;
    out[outAt + 8] = tipX * sine;
    out[outAt + 9] = tipY;
    out[outAt + 10] = tipX * cosine;
  }

  /** The table's value for a tip at distance `r` whose direction has these `level` (not below zero) and `up` parts. */
  private share(r: number, level: number, up: number): number {
    const q = Math.sqrt((1 - r) * this.rows);
    const u = (1 - q) * (1 + 0.75 * q) * (SIDE - 1);
    const v = (0.5 + (0.5 * up) / (level + Math.abs(up))) * (SIDE - 1);
    const i = Math.min(Math.trunc(u), SIDE - 2), j = Math.min(Math.trunc(v), SIDE - 2);
    const p = u - i, w = v - j, at = i * SIDE + j, node = this.table;
    const inside = node[at] + (node[at + 1] - node[at]) * w;
    const outside = node[at + SIDE] + (node[at + SIDE + 1] - node[at + SIDE]) * w;
    return inside + (outside - inside) * p;
  }
}
