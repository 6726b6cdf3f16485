/**
 * Elbow of one arm: where gravity puts it, at a bounded speed, within the limit of the shoulder.
 *
 * With the hand tip given, an arm has two freedoms: it turns about the chord, the segment from shoulder to tip,
 * and it trades wrist bend for elbow bend, which lifts the upper arm off the chord. Both have a state that follows
 * gravity, so that the elbow neither crosses over when the hand passes straight below the shoulder nor snaps at
 * full stretch. Python: `marionette/elbow_step.py`, with more detail.
 */

import { type Numbers, rotate } from "../motion/rotation";
import {
  addScaled,
  anyPerpendicular,
  combine,
  cross,
  distanceBetween,
  dot,
  length,
  rejectFrom,
  rotationBetween,
  setVector,
  unit,
} from "../motion/vector";
import type { Arm } from "./arm";
import {
  CAP_CLEARANCE_RAD,
  HALF_SWING_DISTANCE,
  MAX_ELBOW_BEND_RAD,
  MAX_ELBOW_SPEED,
  MAX_LIFT_SPEED,
  MAX_OFFSET_PER_SLACK,
  MAX_SWING_SPEED_RAD_S,
  MAX_TIP_DISTANCE,
  MAX_WRIST_BEND_RAD,
  MIN_SWING_SPEED,
  SWING_HALF_LIFE_S,
} from "./constants";
import type { ShoulderLimit } from "./shoulder";

/**
 * Solved arm. `tip` (3) is in arm lengths and differs from the target only while the shoulder's limit leaves no
 * other way; `normal` (3) is the unit normal of the arm's plane; `bend` is the bend of the wrist.
 */
export interface ArmConfiguration {
  readonly tip: Float64Array;
  readonly normal: Float64Array;
  bend: number;
}

function clamp(min: number, value: number, max: number): number {
  return Math.min(Math.max(value, min), max);
}

function clampedAcos(x: number): number {
  return Math.acos(clamp(-1, x, 1));
}

/**
 * Write the normal (3) of the vertical plane through the unit `direction`; return false, writing nothing, within
 * 1e-9 of the axis. A positive rotation about it raises the outer end: it is the axis of the elbow's bend.
 */
export function verticalNormal(out: Numbers, direction: Numbers, up: Numbers): boolean {
  const [x, y, z] = out;
  cross(out, 0, direction, 0, up, 0);
  if (unit(out, 0, out, 0, 1e-9)) return true;
  setVector(out, 0, x, y, z);
  return false;
}

const level = new Float64Array(3);

/** Return the angle of a unit vector (3) above the horizontal, radians, -pi/2..pi/2. */
export function elevation(direction: Numbers, up: Numbers): number {
  rejectFrom(level, 0, direction, 0, up, 0);
  return Math.atan2(dot(direction, 0, up, 0), length(level, 0));
}

/** Return the angle of an elbow (3, from the shoulder) off the unit `direction` of the tip, radians. */
export function liftAngle(elbow: Numbers, direction: Numbers): number {
  const along = dot(elbow, 0, direction, 0);
  return Math.atan2(Math.sqrt(Math.max(dot(elbow, 0, elbow, 0) - along * along, 0)), along);
}

/** Return the angle between two unit vectors (3); from half the chord, because the arc cosine loses small angles. */
export function angleBetween(a: Numbers, b: Numbers): number {
  return 2 * Math.asin(Math.min(0.5 * distanceBetween(a, 0, b, 0), 1));
}

/** State of one arm's elbow, in the shoulder's frame so that a turning body carries it. */
export class Elbow {
  private readonly direction = new Float64Array(3);
  private readonly normal = Float64Array.of(1, 0, 0);
  private lift = 0;
  private isStarted = false;
  /** Last shown direction of the upper arm, if there is one. */
  private readonly lastUpperArm = new Float64Array(3);
  private hasLastUpperArm = false;
  private readonly configuration: ArmConfiguration = { tip: new Float64Array(3), normal: new Float64Array(3), bend: 0 };
  private readonly before = new Float64Array(3);
  private readonly upperArm = new Float64Array(3);
  private readonly targetVector = new Float64Array(3);
  private readonly side = new Float64Array(3);
  private readonly along = new Float64Array(3);
  private readonly carry = new Float64Array(4);
  private readonly limits = new Float64Array(2);

  constructor(
    private readonly arm: Arm,
    private readonly shoulder: ShoulderLimit,
  ) {}

  /** Forget the state; `begin` must be called before the next step. */
  reset(): void {
    this.isStarted = this.hasLastUpperArm = false;
  }

  /** True if `begin` was called since the last reset. */
  get hasBegun(): boolean {
    return this.isStarted;
  }

  /**
   * Start with the tip in the unit `direction` and the upper arm `lift` radians off the chord. The normal is the
   * part of `normal` perpendicular to the direction.
   */
  begin(direction: Numbers, normal: Numbers, lift: number): void {
    this.direction.set(direction);
    this.setNormal(normal, direction);
    this.lift = lift;
    this.isStarted = true;
  }

  /**
   * Return the arm with its tip in the unit `direction` at `reach` arm lengths, `seconds` after the last step.
   * `up` is the world's up in the same frame. The next call overwrites the result.
   */
  step(direction: Numbers, reach: number, up: Numbers, seconds: number): ArmConfiguration {
    const { arm, shoulder, normal, before, upperArm, configuration, targetVector } = this;
    const { upper } = arm.proportions;
    this.computeUpperArm(before, this.direction, normal, this.lift);
    rotationBetween(this.carry, 0, this.direction, 0, direction, 0);
    rotate(normal, 0, this.carry, 0, normal, 0);
    this.setNormal(normal, direction);
    this.direction.set(direction);
    let r = arm.clampDistance(reach);
    // the lift vanishes at full stretch: reduce it evenly, not within the last frames
    const goal = Math.min(
      this.liftForBend(r, arm.gravityBend(r, elevation(direction, up))),
      (MAX_OFFSET_PER_SLACK * (MAX_TIP_DISTANCE - r)) / upper,
    );
    const step = (MAX_LIFT_SPEED * seconds) / upper;
    let lift = clamp(this.lift - step, goal, this.lift + step);
    lift = clamp(this.minLift(r), lift, this.maxLift(r));
    this.computeUpperArm(upperArm, direction, normal, lift);
    const moved = angleBetween(upperArm, before) * upper;
    const left = Math.max(MAX_ELBOW_SPEED * seconds - moved, MIN_SWING_SPEED * seconds);
    this.swingNormal(direction, up, r, lift, seconds, left);
    this.lift = lift;
    let turn = shoulder.minAllowedTurn(direction, normal, lift);
    if (turn === null) {
      // no turn helps: bend the elbow more, and if that does not help, bring the hand nearer
      const minLift = shoulder.angleToAllowed(direction) + CAP_CLEARANCE_RAD;
      if (minLift > this.maxLift(r)) r = this.maxDistanceForLift(r, minLift);
      lift = Math.min(Math.max(lift, minLift), this.maxLift(r));
      turn = shoulder.minAllowedTurn(direction, normal, lift);
      this.rotateNormal(direction, turn ?? 0);
    } else if (turn !== 0) {
      this.rotateNormal(direction, turn);
    }
    this.computeUpperArm(upperArm, direction, normal, lift);
    const maxAngle = (moved + left) / upper;
    configuration.normal.set(normal);
    if (this.hasLastUpperArm && (turn === null || angleBetween(upperArm, this.lastUpperArm) > maxAngle)) {
      // the shoulder's limit leaves only a long way: the hand waits for the elbow; near the shoulder both wait
      if (turn !== null) shoulder.stepToward(this.lastUpperArm, this.lastUpperArm, upperArm, maxAngle);
      for (let i = 0; i < 3; i++) targetVector[i] = direction[i] * reach;
      this.reachFromUpperArm(this.lastUpperArm, targetVector);
    } else {
      this.lastUpperArm.set(upperArm);
      for (let i = 0; i < 3; i++) configuration.tip[i] = direction[i] * r;
      configuration.bend = this.bendForLift(r, lift);
    }
    this.hasLastUpperArm = true;
    return configuration;
  }

  /** Return what `step` would return, without effect. The next call of either overwrites the result. */
  preview(direction: Numbers, reach: number, up: Numbers, seconds: number): ArmConfiguration {
    const { lift, hasLastUpperArm } = this;
    const earlier = [this.direction, this.normal, this.lastUpperArm].map((state) => state.slice());
    const configuration = this.step(direction, reach, up, seconds);
    [this.direction, this.normal, this.lastUpperArm].forEach((state, nth) => state.set(earlier[nth]));
    this.lift = lift;
    this.hasLastUpperArm = hasLastUpperArm;
    return configuration;
  }

  private setNormal(normal: Numbers, direction: Numbers): void {
    rejectFrom(this.normal, 0, normal, 0, direction, 0);
    if (!unit(this.normal, 0, this.normal, 0)) anyPerpendicular(this.normal, 0, direction, 0);
  }

  /** Write the unit vector (3) from the shoulder to the elbow. */
  private computeUpperArm(out: Numbers, direction: Numbers, normal: Numbers, lift: number): void {
    cross(this.side, 0, direction, 0, normal, 0);
    combine(out, 0, direction, 0, Math.cos(lift), this.side, 0, Math.sin(lift));
  }

  /** Swing the normal about the chord towards that of the vertical plane, by at most the allowed elbow travel. */
  private swingNormal(
    direction: Numbers,
    up: Numbers,
    r: number,
    lift: number,
    seconds: number,
    maxTravel: number,
  ): void {
    const { normal, targetVector, side } = this;
    if (!verticalNormal(targetVector, direction, up)) return;
    rejectFrom(side, 0, direction, 0, up, 0);
    const off = length(side, 0) * r;
    const pull = (off * off) / (off * off + HALF_SWING_DISTANCE * HALF_SWING_DISTANCE);
    cross(side, 0, normal, 0, targetVector, 0);
    const swing = Math.atan2(dot(side, 0, direction, 0), dot(normal, 0, targetVector, 0));
    const maxAngle = Math.min(
      MAX_SWING_SPEED_RAD_S * seconds,
      maxTravel / Math.max(this.arm.proportions.upper * Math.sin(lift), 1e-3),
    );
    this.rotateNormal(
      direction,
      clamp(-maxAngle, swing * (1 - 2 ** ((-seconds * pull) / SWING_HALF_LIFE_S)), maxAngle),
    );
  }

  private rotateNormal(direction: Numbers, turn: number): void {
    const { normal, side } = this;
    cross(side, 0, direction, 0, normal, 0);
    combine(normal, 0, normal, 0, Math.cos(turn), side, 0, Math.sin(turn));
    unit(normal, 0, normal, 0);
  }

  /** Solve forearm and hand as near to `target` as this upper arm allows. */
  private reachFromUpperArm(upperArm: Numbers, target: Numbers): void {
    const { upper, forearm: fore, hand } = this.arm.proportions;
    const { configuration, side, along, before: toTarget, targetVector: direction } = this;
    const { tip, normal } = configuration;
    addScaled(toTarget, 0, target, 0, upperArm, 0, -upper);
    const shortest = Math.sqrt(fore * fore + hand * hand + 2 * fore * hand * Math.cos(MAX_WRIST_BEND_RAD));
    const reach = clamp(shortest, length(toTarget, 0), fore + hand);
    // where forearm and hand are straight, the cosine has no digits left for the bend
    const bend = reach < fore + hand ? clampedAcos((reach * reach - fore * fore - hand * hand) / (2 * fore * hand)) : 0;
    const lean = Math.atan2(hand * Math.sin(bend), fore + hand * Math.cos(bend));
    rejectFrom(side, 0, toTarget, 0, upperArm, 0);
    if (!unit(side, 0, side, 0)) cross(side, 0, normal, 0, upperArm, 0);
    let angle = Math.atan2(dot(toTarget, 0, side, 0), dot(toTarget, 0, upperArm, 0));
    angle = clamp(lean, angle, Math.min(MAX_ELBOW_BEND_RAD + lean, Math.PI));
    combine(along, 0, upperArm, 0, Math.cos(angle), side, 0, Math.sin(angle));
    combine(tip, 0, upperArm, 0, upper, along, 0, reach);
    const r = Math.min(length(tip, 0), MAX_TIP_DISTANCE);
    if (!unit(direction, 0, tip, 0)) direction.set(upperArm);
    rejectFrom(side, 0, upperArm, 0, direction, 0);
    if (!unit(side, 0, side, 0)) cross(side, 0, direction, 0, normal, 0);
    cross(normal, 0, side, 0, direction, 0);
    for (let i = 0; i < 3; i++) tip[i] = direction[i] * r;
    this.arm.bendLimits(this.limits, 0, r);
    configuration.bend = clamp(this.limits[0], bend, this.limits[1]);
  }

  /** Return the largest distance up to `r` at which the upper arm can be `minLift` radians off the chord. */
  private maxDistanceForLift(r: number, minLift: number): number {
    let near = this.arm.minTipDistance,
      far = r;
    for (let i = 0; i < 40; i++) {
      const middle = 0.5 * (near + far);
      if (this.maxLift(middle) >= minLift) near = middle;
      else far = middle;
    }
    return near;
  }

  /** Return the smallest lift that reaches `r` within the joint limits. */
  private minLift(r: number): number {
    this.arm.bendLimits(this.limits, 0, r);
    return this.liftForBend(r, this.limits[1]);
  }

  /** Return the largest lift that reaches `r` within the joint limits. */
  private maxLift(r: number): number {
    this.arm.bendLimits(this.limits, 0, r);
    return this.liftForBend(r, this.limits[0]);
  }

  private liftForBend(r: number, bend: number): number {
    const { upper, forearm: fore, hand } = this.arm.proportions;
    const square = fore * fore + hand * hand + 2 * fore * hand * Math.cos(bend);
    return clampedAcos((upper * upper + r * r - square) / (2 * upper * r));
  }

  private bendForLift(r: number, lift: number): number {
    const { upper, forearm: fore, hand } = this.arm.proportions;
    // at a limit the cosine has no digits left for the bend
    if (lift >= this.maxLift(r)) return this.limits[0];
    const square = upper * upper + r * r - 2 * upper * r * Math.cos(lift);
    return clamp(this.limits[0], clampedAcos((square - fore * fore - hand * hand) / (2 * fore * hand)), this.limits[1]);
  }
}
