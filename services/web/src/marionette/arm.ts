/**
 * The potential-based arm (paper 4), closed exactly. Upper arm, forearm and hand hang in a plane; the table holds where
 * between its limits gravity leaves the wrist bend, and the other joints close on the hand tip.
 *
 * In the plane: x outwards, y up; angles t0, t1, t2 of the links from x towards y, radians; lengths in arm lengths. In
 * space y is up, and the azimuth of the plane is from z (forwards) towards x. The Python rooms `marionette/arm.py` (angles)
 * and `marionette/arms.py` (places) give the same numbers.
 */

import type { Numbers } from "../motion/rotation";
import { MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD, MIN_TARGET_DISTANCE, TABLE_SIDE } from "./constants";
import { minTipDistance, type Proportions } from "./proportions";

/** Sine of half the wrist's limit. */
const MAX_HALF_BEND_SINE = Math.sin(MAX_WRIST_BEND_RAD / 2);
/** A level distance is 0 below this: far under any that matters, far above where a square loses digits. */
const MIN_HORIZONTAL_DISTANCE = 1e-150;

/** Bytes of a table as it is served. */
export const TABLE_BYTES = TABLE_SIDE * TABLE_SIDE * 2;
/** Numbers that `solve` writes: sine and cosine of the azimuth, then elbow, wrist and tip. */
export const NUMBERS_PER_ARM = 11;

/** The table in `bytes` (64 x 64 float16, little-endian). Throws `RangeError` if it is not one. */
export function parseBendTable(bytes: Uint8Array): Float64Array {
  if (bytes.length !== TABLE_BYTES) {
    throw new RangeError(`a table of an arm has ${TABLE_BYTES} bytes, not ${bytes.length}`);
  }
  const table = new Float64Array(TABLE_SIDE * TABLE_SIDE);
  for (let i = 0; i < table.length; i++) {
    const bits = bytes[2 * i] | (bytes[2 * i + 1] << 8);
    const exponent = bits >> 10,
      fraction = (bits & 1023) / 1024;
    const value = exponent === 0 ? fraction * 2 ** -14 : (1 + fraction) * 2 ** (exponent - 15);
    // a sign, an infinity or a NaN is above 1 too
    if (!(value <= 1)) throw new RangeError("a table of an arm has values in 0..1 only");
    table[i] = value;
  }
  return table;
}

function clampedAcos(x: number): number {
  return Math.acos(Math.min(Math.max(x, -1), 1));
}

/** One arm's shape and table. */
export class Arm {
  /** The nearest to the shoulder that a hand tip is solved for. */
  readonly minTipDistance: number;
  private readonly inverseDistanceRange: number;
  /** With the elbow straight, and with it bent to its limit: 1 / (4 x distance of the wrist x hand). */
  private readonly straightElbowFactor: number;
  private readonly foldedElbowFactor: number;
  /** The bent elbow: distance of the wrist, and the angle from the line to it to the forearm (negative). */
  private readonly foldedWristDistance: number;
  private readonly foldedLean: number;
  private readonly halfLeanSine: number;
  private readonly halfLeanCosine: number;
  /** Squares of the nearest and the farthest that this elbow reaches, and of where it does with the wrist straight. */
  private readonly foldedNearSquared: number;
  private readonly foldedFarSquared: number;
  private readonly foldedStraightWristSquared: number;
  private readonly bendRange = new Float64Array(2);

  constructor(
    readonly proportions: Proportions,
    private readonly table: Float64Array,
  ) {
    const { upper, forearm: fore, hand } = proportions;
    this.minTipDistance = minTipDistance(proportions);
    this.inverseDistanceRange = 1 / (1 - this.minTipDistance);
    const x = upper + fore * Math.cos(MAX_ELBOW_BEND_RAD),
      y = fore * Math.sin(MAX_ELBOW_BEND_RAD);
    const distance = (this.foldedWristDistance = Math.hypot(x, y));
    this.foldedLean = Math.atan2(y, x) - MAX_ELBOW_BEND_RAD;
    this.halfLeanSine = Math.sin(this.foldedLean / 2);
    this.halfLeanCosine = Math.cos(this.foldedLean / 2);
    this.straightElbowFactor = 1 / (4 * (upper + fore) * hand);
    this.foldedElbowFactor = 1 / (4 * distance * hand);
    this.foldedNearSquared = (distance - hand) ** 2;
    this.foldedFarSquared = (distance + hand) ** 2;
    this.foldedStraightWristSquared =
      distance * distance + hand * hand + 2 * distance * hand * Math.cos(this.foldedLean);
  }

  /** The nearest distance that is solved for. */
  clampDistance(r: number): number {
    return clampDistance(r, this.minTipDistance);
  }

  /** Least and greatest wrist bend (2), radians, that reach `r` (clamped) with elbow and wrist within their limits. */
  bendLimits(out: Numbers, outAt: number, r: number): void {
    const { upper, forearm: fore, hand } = this.proportions;
    const straight = upper + fore,
      folded = this.foldedWristDistance;
    const high = Math.min(
      MAX_WRIST_BEND_RAD,
      clampedAcos((r * r - straight * straight - hand * hand) / (2 * straight * hand)),
    );
    const low = this.foldedLean + clampedAcos((r * r - folded * folded - hand * hand) / (2 * folded * hand));
    out[outAt] = Math.min(Math.max(low, 0), high);
    out[outAt + 1] = high;
  }

  /** The wrist bend, radians, at which gravity leaves an arm with its tip at (`r`, `beta`), from the table. */
  gravityBend(r: number, beta: number): number {
    const { bendRange: limit } = this;
    this.bendLimits(limit, 0, r);
    const least = Math.sin(limit[0] / 2),
      greatest = Math.sin(limit[1] / 2);
    const share = interpolateTable(
      this.table,
      Math.sqrt((1 - r) * this.inverseDistanceRange),
      Math.cos(beta),
      Math.sin(beta),
    );
    return 2 * Math.asin(least + share * (greatest - least));
  }

  /**
   * t0, t1, t2 that bring the tip to (`r`, `beta`) with the wrist bent by `bend`, elbow below. Exact for any `bend` within
   * `limits`; beyond them the arm does not reach, or a joint breaks its limit.
   */
  closeChain(out: Numbers, outAt: number, r: number, beta: number, bend: number): void {
    const { upper, forearm: fore, hand } = this.proportions;
    const x = fore + hand * Math.cos(bend),
      y = hand * Math.sin(bend);
    const lower = Math.sqrt(x * x + y * y);
    const t0 = beta - clampedAcos((upper * upper + r * r - lower * lower) / (2 * upper * r));
    const t1 = t0 + clampedAcos((r * r - upper * upper - lower * lower) / (2 * upper * lower)) - Math.atan2(y, x);
    out[outAt] = t0;
    out[outAt + 1] = t1;
    out[outAt + 2] = t1 + bend;
  }

  /** t0, t1, t2 for a tip at distance `r` (already clamped) and elevation `beta`, -pi/2..pi/2. */
  solveAngles(out: Numbers, outAt: number, r: number, beta: number): void {
    this.closeChain(out, outAt, r, beta, this.gravityBend(r, beta));
  }

  /**
   * The arms whose tips are at `count` targets (x, y, z each, from `targetsAt` on), in the vertical plane: `SOLVED` numbers
   * each into `out`. A target out of reach is brought in with its direction kept; the shoulder's own place counts as
   * straight below.
   *
   * Square roots alone: a place in the plane is a complex number, and joints turn by multiplying. First all bends, then all
   * arms: one arm's numbers wait for each other, and shorter chains let the processor work at more arms at once.
   */
  solveArms(out: Numbers, outAt: number, targets: Numbers, targetsAt: number, count = 1): void {
    const { upper, forearm: fore, hand } = this.proportions;
    const {
      minTipDistance: inner,
      straightElbowFactor: straight,
      foldedElbowFactor: folded,
      foldedStraightWristSquared: fold,
      foldedNearSquared: near,
      foldedFarSquared: far,
      halfLeanSine: leanSine,
      halfLeanCosine: leanCosine,
      inverseDistanceRange: rows,
      table,
    } = this;
    const upperSquare = upper * upper,
      whole = (fore + hand) * (fore + hand),
      part = 4 * fore * hand;
    for (let from = targetsAt, to = outAt; from < targetsAt + 3 * count; from += 3, to += NUMBERS_PER_ARM) {
      const x = targets[from],
        z = targets[from + 2],
        flat = x * x + z * z;
      let up = targets[from + 1],
        level = Math.sqrt(flat),
        reach = Math.sqrt(flat + up * up);
      if (!(reach >= MIN_TARGET_DISTANCE)) {
        level = 0;
        up = -MIN_TARGET_DISTANCE;
        reach = MIN_TARGET_DISTANCE;
      }
      let sine = 0,
        cosine = 1;
      if (level >= MIN_HORIZONTAL_DISTANCE) {
        const scale = 1 / level;
        sine = x * scale;
        cosine = z * scale;
      }
      const share = interpolateTable(table, Math.sqrt((1 - clampDistance(reach, inner)) * rows), level, up);
      if (reach < inner || reach > MAX_TIP_DISTANCE) {
        const r = clampDistance(reach, inner),
          scale = r / reach;
        level *= scale;
        up *= scale;
        reach = r;
      }
      const square = reach * reach,
        inverse = 1 / square;
      let greatest = Math.sqrt((1 - square) * straight);
      if (greatest > MAX_HALF_BEND_SINE) greatest = MAX_HALF_BEND_SINE;
      let least = 0;
      if (square < fold) {
        // half of an angle sum: the folded elbow's lean, and the bend that reaches so far from there
        const bendSine = Math.sqrt(Math.min((far - square) * folded, 1));
        const bendCosine = Math.sqrt(Math.max((square - near) * folded, 0));
        least = Math.min(Math.max(leanSine * bendCosine + leanCosine * bendSine, 0), greatest);
      }
      out[to] = sine;
      out[to + 1] = cosine;
      out[to + 2] = level;
      out[to + 3] = up;
      out[to + 4] = inverse;
      out[to + 5] = least + share * (greatest - least);
    }
    for (let to = outAt; to < outAt + NUMBERS_PER_ARM * count; to += NUMBERS_PER_ARM) {
      const sine = out[to],
        cosine = out[to + 1],
        level = out[to + 2],
        up = out[to + 3],
        inverse = out[to + 4];
      const half = out[to + 5],
        halfSquare = half * half;
      const cosBend = 1 - 2 * halfSquare,
        sinBend = 2 * half * Math.sqrt(1 - halfSquare);
      // the rest of the arm, seen along the forearm, and the triangle it makes with the upper arm
      const restX = fore + hand * cosBend,
        restY = hand * sinBend,
        rest = whole - part * halfSquare;
      const along = 0.5 + (upperSquare - rest) * 0.5 * inverse;
      const belowSquare = upperSquare * inverse - along * along;
      const below = belowSquare > 0 ? Math.sqrt(belowSquare) : 0;
      const elbowX = level * along + up * below,
        elbowY = up * along - level * below;
      const turn = 1 / rest,
        turnX = restX * turn,
        turnY = restY * turn,
        chordX = level - elbowX,
        chordY = up - elbowY;
      const foreX = chordX * turnX + chordY * turnY,
        foreY = chordY * turnX - chordX * turnY;
      const wristX = elbowX + fore * foreX,
        wristY = elbowY + fore * foreY;
      const tipX = wristX + hand * (foreX * cosBend - foreY * sinBend);
      const tipY = wristY + hand * (foreY * cosBend + foreX * sinBend);
      out[to + 2] = elbowX * sine;
      out[to + 3] = elbowY;
      out[to + 4] = elbowX * cosine;
      out[to + 5] = wristX * sine;
      out[to + 6] = wristY;
      out[to + 7] = wristX * cosine;
      out[to + 8] = tipX * sine;
      out[to + 9] = tipY;
      out[to + 10] = tipX * cosine;
    }
  }
}

/** `reach` within what is solved for. */
function clampDistance(reach: number, inner: number): number {
  return reach < inner ? inner : reach > MAX_TIP_DISTANCE ? MAX_TIP_DISTANCE : reach;
}

/**
 * The table's value, `slack` being the root of the share of its reach that an arm has left, for a tip in the direction of `level`
 * (not below zero) and `up`.
 */
function interpolateTable(table: Float64Array, slack: number, level: number, up: number): number {
  const u = (1 - slack) * (1 + 0.75 * slack) * (TABLE_SIDE - 1);
  const v = (0.5 + (0.5 * up) / (level + Math.abs(up))) * (TABLE_SIDE - 1);
  let i = u | 0,
    j = v | 0;
  if (i > TABLE_SIDE - 2) i = TABLE_SIDE - 2;
  if (j > TABLE_SIDE - 2) j = TABLE_SIDE - 2;
  const p = u - i,
    q = v - j,
    at = i * TABLE_SIDE + j;
  const inside = table[at] + (table[at + 1] - table[at]) * q;
  const outside = table[at + TABLE_SIDE] + (table[at + TABLE_SIDE + 1] - table[at + TABLE_SIDE]) * q;
  return inside + (outside - inside) * p;
}
