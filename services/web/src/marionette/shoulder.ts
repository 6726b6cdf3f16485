/**
 * Limit of the shoulder: spherical caps of directions that the upper arm cannot take (complement of the reach
 * cones of Wilhelms and Van Gelder, Fast and Easy Reach-Cone Joint Limits, 2001). Directions are unit vectors on
 * the axes of vl5: x to the left, y up, z forwards. Python: `marionette/shoulder.py`.
 */

import { type Numbers, rotate } from "../motion/rotation";
import { anyPerpendicular, combine, cross, dot, fromAxisAngle, length, rejectFrom, unit } from "../motion/vector";
import { CAP_EDGE_MARGIN_RAD, LEFT_SHOULDER_CAPS } from "./constants";

const FULL_TURN_RAD = 2 * Math.PI;

/** Excluded directions: those within `radius` radians of the unit vector `axis` (3). */
export interface ExclusionCap {
  readonly axis: Float64Array;
  readonly radius: number;
}

/** Excluded directions of the left upper arm. */
const LEFT_CAPS: readonly ExclusionCap[] = LEFT_SHOULDER_CAPS.map(({ axis, radius }) => {
  const direction = Float64Array.from(axis);
  unit(direction, 0, direction, 0);
  return { axis: direction, radius };
});

const crossProduct = new Float64Array(3);

/** Return the angle between two unit vectors (3), radians. */
function angleBetween(a: Numbers, b: Numbers): number {
  cross(crossProduct, 0, a, 0, b, 0);
  return Math.atan2(length(crossProduct, 0), dot(a, 0, b, 0));
}

function wrapAngle(angle: number): number {
  const rest = (angle + Math.PI) % FULL_TURN_RAD;
  return (rest < 0 ? rest + FULL_TURN_RAD : rest) - Math.PI;
}

function depthInCap({ axis, radius }: ExclusionCap, direction: Numbers): number {
  return radius - angleBetween(axis, direction);
}

/** Return the two unit vectors where the edges of two caps cross, or none. */
function capCorners(one: ExclusionCap, other: ExclusionCap): Float64Array[] {
  const d = dot(one.axis, 0, other.axis, 0);
  const square = 1 - d * d;
  if (square < CAP_EDGE_MARGIN_RAD) return [];
  const a = (Math.cos(one.radius) - d * Math.cos(other.radius)) / square;
  const b = (Math.cos(other.radius) - d * Math.cos(one.radius)) / square;
  const middle = new Float64Array(3),
    side = new Float64Array(3);
  combine(middle, 0, one.axis, 0, a, other.axis, 0, b);
  const left = 1 - dot(middle, 0, middle, 0);
  if (left <= 0) return [];
  cross(side, 0, one.axis, 0, other.axis, 0);
  const off = Math.sqrt(left / square);
  return [off, -off].map((by) => middle.map((part, i) => part + side[i] * by));
}

/** Limit of one shoulder. */
export class ShoulderLimit {
  readonly caps: readonly ExclusionCap[];
  private readonly corners: readonly Float64Array[];
  /** Blocked intervals of turns, one per cap: middle and half width. */
  private readonly blockedMiddles: Float64Array;
  private readonly blockedHalfWidths: Float64Array;
  private readonly edge = new Float64Array(3);
  private readonly side = new Float64Array(3);
  private readonly step = new Float64Array(3);
  private readonly stepRotation = new Float64Array(4);

  /** The caps of the right shoulder mirror those of the left one. */
  constructor(right: boolean) {
    this.caps = right
      ? LEFT_CAPS.map(({ axis, radius }) => ({ axis: Float64Array.of(-axis[0], axis[1], axis[2]), radius }))
      : LEFT_CAPS;
    this.corners = this.caps
      .flatMap((one, i) => this.caps.slice(i + 1).flatMap((other) => capCorners(one, other)))
      .filter((corner) => this.depthInCaps(corner) <= CAP_EDGE_MARGIN_RAD);
    this.blockedMiddles = new Float64Array(this.caps.length);
    this.blockedHalfWidths = new Float64Array(this.caps.length);
  }

  /** Return the largest depth of a unit vector (3) inside a cap, radians; at most zero for an allowed direction. */
  depthInCaps(direction: Numbers): number {
    let depth = -Infinity;
    for (const one of this.caps) depth = Math.max(depth, depthInCap(one, direction));
    return depth;
  }

  /** Return the angle from a unit vector (3) to the nearest allowed direction, radians. */
  angleToAllowed(direction: Numbers): number {
    if (this.depthInCaps(direction) <= 0) return 0;
    let nearest = Infinity;
    for (const one of this.caps) {
      this.computeEdge(direction, one, one.radius);
      if (this.depthInCaps(this.edge) <= CAP_EDGE_MARGIN_RAD)
        nearest = Math.min(nearest, angleBetween(this.edge, direction));
    }
    for (const corner of this.corners) nearest = Math.min(nearest, angleBetween(corner, direction));
    return nearest;
  }

  /**
   * Write the unit vector (3) `maxAngle` radians from `begin` on a path to `end` round the caps; `end` if it is
   * nearer.
   */
  stepToward(out: Numbers, begin: Numbers, end: Numbers, maxAngle: number): void {
    if (angleBetween(begin, end) <= maxAngle) {
      out.set(end);
      return;
    }
    const { step, side, stepRotation } = this;
    cross(side, 0, begin, 0, end, 0);
    if (!unit(side, 0, side, 0)) anyPerpendicular(side, 0, begin, 0);
    fromAxisAngle(stepRotation, 0, side, 0, maxAngle);
    rotate(step, 0, stepRotation, 0, begin, 0);
    for (const one of this.caps) {
      if (!(depthInCap(one, step) > 0 && depthInCap(one, begin) <= 0)) continue;
      // along the edge, on the side that leads on
      this.computeEdge(step, one, one.radius + CAP_EDGE_MARGIN_RAD);
      step.set(this.edge);
    }
    // stay in a corner of two caps
    out.set(this.depthInCaps(step) <= Math.max(this.depthInCaps(begin), 0) ? step : begin);
  }

  /**
   * Return the smallest turn about the unit `chord`, radians, that gives the upper arm an allowed direction; null
   * for none. The upper arm is `lift` radians below the chord in the plane of the unit `normal`.
   */
  minAllowedTurn(chord: Numbers, normal: Numbers, lift: number): number | null {
    const { blockedMiddles: middles, blockedHalfWidths: halves, side } = this;
    const along = Math.cos(lift),
      off = Math.sin(lift);
    cross(side, 0, chord, 0, normal, 0);
    let closed = 0;
    for (const { axis, radius } of this.caps) {
      const a = dot(axis, 0, side, 0),
        b = -dot(axis, 0, normal, 0);
      const swing = off * Math.hypot(a, b);
      const over = Math.cos(radius) - along * dot(axis, 0, chord, 0);
      if (over >= swing) continue;
      if (over <= -swing) return null;
      middles[closed] = Math.atan2(b, a);
      halves[closed++] = Math.acos(over / swing);
    }
    if (this.isAllowed(0, closed)) return 0;
    let least: number | null = null;
    for (let i = 0; i < closed; i++) {
      for (const sign of [-1, 1]) {
        const turn = wrapAngle(middles[i] + sign * (halves[i] + CAP_EDGE_MARGIN_RAD));
        if (this.isAllowed(turn, closed) && (least === null || Math.abs(turn) < Math.abs(least))) least = turn;
      }
    }
    return least;
  }

  private isAllowed(turn: number, closed: number): boolean {
    for (let i = 0; i < closed; i++) {
      if (!(Math.abs(wrapAngle(turn - this.blockedMiddles[i])) >= this.blockedHalfWidths[i])) return false;
    }
    return true;
  }

  /** Compute the direction `radius` radians from the cap's axis, on the side of `direction`. */
  private computeEdge(direction: Numbers, { axis }: ExclusionCap, radius: number): void {
    const { edge } = this;
    rejectFrom(edge, 0, direction, 0, axis, 0);
    if (!unit(edge, 0, edge, 0)) anyPerpendicular(edge, 0, axis, 0);
    combine(edge, 0, axis, 0, Math.cos(radius), edge, 0, Math.sin(radius));
  }
}
