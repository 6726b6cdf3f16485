/**
 * The potential-based arm (paper 4), closed exactly. Upper arm, forearm and hand hang in a plane; the bend table
 * holds the wrist bend of least energy relative to its limits, and the other joints close on the hand tip.
 *
 * In the plane x points outwards and y up; angles t0, t1, t2 of the links are from x towards y, radians; lengths
 * are in arm lengths. In space y is up, and the azimuth of the plane is from z (forwards) towards x. Python:
 * `marionette/arm.py` (angles) and `marionette/arm_batch.py` (positions) return the same numbers.
 */

import type { Numbers } from "../motion/rotation";
import { MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD, MIN_TARGET_DISTANCE, TABLE_SIDE } from "./constants";
import { minTipDistance, type Proportions } from "./proportions";

/** Sine of half the wrist's limit. */
const MAX_HALF_BEND_SINE = Math.sin(MAX_WRIST_BEND_RAD / 2);
/** Horizontal distance below which the tip counts as on the axis: far below any that matters. */
const MIN_HORIZONTAL_DISTANCE = 1e-150;

/** Size of a packed table. */
export const TABLE_BYTES = TABLE_SIDE * TABLE_SIDE * 2;
/** Numbers per arm of `solveArms`: sine and cosine of the azimuth, then elbow, wrist and tip. */
export const NUMBERS_PER_ARM = 11;

/** Parse a table (64 x 64 float16, little-endian). Throws `RangeError` for invalid bytes. */
export function parseBendTable(bytes: Uint8Array): Float64Array {
  if (bytes.length !== TABLE_BYTES) {
    throw new RangeError(`bend table rejected: ${bytes.length} bytes, expected ${TABLE_BYTES}`);
  }
  const table = new Float64Array(TABLE_SIDE * TABLE_SIDE);
  for (let i = 0; i < table.length; i++) {
    const bits = bytes[2 * i] | (bytes[2 * i + 1] << 8);
    const exponent = bits >> 10,
      fraction = (bits & 1023) / 1024;
    const value = exponent === 0 ? fraction * 2 ** -14 : (1 + fraction) * 2 ** (exponent - 15);
    // a sign, an infinity or a NaN is above 1 too
    if (!(value <= 1)) throw new RangeError("bend table rejected: a value is outside 0..1");
    table[i] = value;
  }
  return table;
}

function clampedAcos(x: number): number {
  return Math.acos(Math.min(Math.max(x, -1), 1));
}

/** One arm with its bend table. */
export class Arm {
  /** Smallest solved distance of the hand tip. */
  readonly minTipDistance: number;
  private readonly inverseDistanceRange: number;
  /** 1 / (4 x distance of the wrist x hand), with the elbow straight and with the elbow at its limit. */
  private readonly straightElbowFactor: number;
  private readonly foldedElbowFactor: number;
  /** With the elbow at its limit: distance of the wrist, and angle from there to the forearm (negative). */
  private readonly foldedWristDistance: number;
  private readonly foldedLean: number;
  private readonly halfLeanSine: number;
  private readonly halfLeanCosine: number;
  /** Squares of the smallest and largest distance with this elbow, and of the one with a straight wrist. */
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

  /** Return the nearest solved distance. */
  clampDistance(r: number): number {
    return clampDistance(r, this.minTipDistance);
  }

  /** Write the smallest and largest wrist bend (2), radians, that reach `r` (clamped) within the joint limits. */
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

  /** Return the wrist bend of least energy, radians, with the tip at (`r`, `beta`). */
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
   * Write t0, t1, t2 with the tip at (`r`, `beta`), the wrist bent by `bend`, and the elbow below. Exact for any
   * `bend` within `bendLimits`; beyond them the arm does not reach, or a joint exceeds its limit.
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

  /** Write t0, t1, t2 for a tip at distance `r` (clamped) and elevation `beta`, -pi/2..pi/2. */
  solveAngles(out: Numbers, outAt: number, r: number, beta: number): void {
    this.closeChain(out, outAt, r, beta, this.gravityBend(r, beta));
  }

  /**
   * Solve the arms with their tips at `count` targets (x, y, z each), in the vertical plane. Writes
   * `NUMBERS_PER_ARM` numbers each. A target out of reach is moved into reach along its direction; the shoulder
   * itself counts as straight below.
   *
   * Only square roots: a position in the plane is a complex number, and joints rotate by multiplication. The first
   * loop computes the bends and the second the arms: shorter dependency chains let the processor overlap several
   * arms.
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
      stretchedSquare = (fore + hand) * (fore + hand),
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
        // half of an angle sum: the lean of the folded elbow and the bend that reaches this distance
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
      // the rest of the arm in the frame of the forearm, and its triangle with the upper arm
      const restX = fore + hand * cosBend,
        restY = hand * sinBend,
        rest = stretchedSquare - part * halfSquare;
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

/** Clamp a distance to the solved range. */
function clampDistance(reach: number, inner: number): number {
  return reach < inner ? inner : reach > MAX_TIP_DISTANCE ? MAX_TIP_DISTANCE : reach;
}

/**
 * Interpolate the table. `slack` is the square root of the share of the reach that is left; the tip is in the
 * direction of `level` (at least zero) and `up`.
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
