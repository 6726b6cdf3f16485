/**
 * Where the elbow goes: where gravity wants it, at a bounded speed, and never where no shoulder lets it.
 *
 * With the hand tip given, an arm is still free in two ways: it turns about the chord, the line from shoulder to tip, and it
 * trades the wrist's bend for the elbow's, which lifts the upper arm off the chord more or less. Both are remembered and
 * follow gravity's: so nothing is thrown across where the hand passes straight below the shoulder, and nothing snaps at full
 * stretch. As `marionette/elbow.py`, which says more.
 */

import { rotate, type Numbers } from "../motion/rotation";
import { across, addScaled, apart, between, combine, cross, dot, length, put, squareTo, unit } from "../motion/vector";
import type { Arm } from "./arm";
import { ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT } from "./proportions";
import type { Shoulder } from "./shoulder";

/** Distance from the vertical axis, in arm lengths, at which the plane is drawn half as fast as far away. */
const NEAR_AXIS = 0.05;
/** Seconds in which the swing left to do halves, far from the axis. */
const HALF_LIFE = 0.08;
/** Radians per second that the plane swings at most. */
const FASTEST = 2 * Math.PI;
/** Arm lengths per second: what the hand's way and the change of bend leave of this is there for the swing. */
export const SPEED = 1.68;
/** Arm lengths that the elbow is off the chord at most, for each arm length that the tip is short of full stretch. */
const SLOPE = 2.4;
/** Arm lengths per second that are there for the swing in any case. */
const LEAST_SPEED = 0.1;
/** Radians that an upper arm keeps from where no shoulder goes. */
const CLEAR = 1e-7;
/** Arm lengths per second that the elbow leaves or nears the chord beyond what the tip asks for. */
const LIFT_SPEED = 1.2;

/**
 * An arm's freedoms settled: where the `tip` (3) is, in arm lengths (not where it was asked to be only while the shoulder's
 * limit leaves no other way), the unit `normal` (3) of the arm's plane, square to it, and the wrist's `bend`.
 */
export interface Hanging {
  readonly tip: Float64Array;
  readonly normal: Float64Array;
  bend: number;
}

function within(least: number, value: number, most: number): number {
  return Math.min(Math.max(value, least), most);
}

function acos(x: number): number {
  return Math.acos(within(-1, x, 1));
}

/**
 * Normal (3) of the vertical plane through the unit `direction`; false, nothing written, within 1e-9 of the axis. Turning about
 * it by a positive angle raises the outer end: it is the axis of the elbow's bend.
 */
export function verticalNormal(out: Numbers, direction: Numbers, up: Numbers): boolean {
  const [x, y, z] = out;
  cross(out, 0, direction, 0, up, 0);
  if (unit(out, 0, out, 0, 1e-9)) return true;
  put(out, 0, x, y, z);
  return false;
}

const level = new Float64Array(3);

/** The angle of a unit vector (3) above the horizontal, radians, -pi/2..pi/2. */
export function elevation(direction: Numbers, up: Numbers): number {
  squareTo(level, 0, direction, 0, up, 0);
  return Math.atan2(dot(direction, 0, up, 0), length(level, 0));
}

/** How far an elbow (3, from the shoulder, any length) is off the unit `direction` of the tip, radians. */
export function liftBetween(elbow: Numbers, direction: Numbers): number {
  const along = dot(elbow, 0, direction, 0);
  return Math.atan2(Math.sqrt(Math.max(dot(elbow, 0, elbow, 0) - along * along, 0)), along);
}

/** The angle between two unit vectors (3), radians; by the half chord, as the arc cosine loses small angles. */
export function angleBetween(a: Numbers, b: Numbers): number {
  return 2 * Math.asin(Math.min(0.5 * apart(a, 0, b, 0), 1));
}

/** One arm's elbow, in the shoulder's frame so that a turning body carries it. */
export class Elbow {
  private readonly direction = new Float64Array(3);
  private readonly normal = Float64Array.of(1, 0, 0);
  private lift = 0;
  private begun = false;
  /** Where the upper arm was shown last, and whether it was. */
  private readonly was = new Float64Array(3);
  private shown = false;
  private readonly hanging: Hanging = { tip: new Float64Array(3), normal: new Float64Array(3), bend: 0 };
  private readonly before = new Float64Array(3);
  private readonly upperArm = new Float64Array(3);
  private readonly wanted = new Float64Array(3);
  private readonly side = new Float64Array(3);
  private readonly along = new Float64Array(3);
  private readonly carry = new Float64Array(4);
  private readonly limits = new Float64Array(2);

  constructor(private readonly arm: Arm, private readonly shoulder: Shoulder) {}

  /** The next call of `begin` starts anew. */
  forget(): void {
    this.begun = this.shown = false;
  }

  /** Whether it has begun. */
  get known(): boolean {
    return this.begun;
  }

  /**
   * Starts with the tip in the unit `direction`, the plane as near to `normal` as square to it allows, and the upper arm `lift`
   * radians off the chord.
   */
  begin(direction: Numbers, normal: Numbers, lift: number): void {
    this.direction.set(direction);
    this.makeSquare(normal, direction);
    this.lift = lift;
    this.begun = true;
  }

  /**
   * The arm once the tip has come to the unit `direction` at `reach` arm lengths, `seconds` after the last. `up` is the world's
   * up, a unit vector in the same frame. The storage is used again by the next call.
   */
  follow(direction: Numbers, reach: number, up: Numbers, seconds: number): Hanging {
    const { arm, shoulder, normal, before, upperArm, hanging, wanted } = this;
    const { upper } = arm.proportions;
    this.toUpperArm(before, this.direction, normal, this.lift);
    between(this.carry, 0, this.direction, 0, direction, 0);
    rotate(normal, 0, this.carry, 0, normal, 0);
    this.makeSquare(normal, direction);
    this.direction.set(direction);
    let r = arm.clamp(reach);
    // towards full stretch the lift ends anyhow: evenly, and not within the last frames
    const goal = Math.min(this.liftOf(r, arm.bend(r, elevation(direction, up))), (SLOPE * (OUTER_RADIUS - r)) / upper);
    const step = (LIFT_SPEED * seconds) / upper;
    let lift = within(this.lift - step, goal, this.lift + step);
    lift = within(this.leastLift(r), lift, this.greatestLift(r));
    this.toUpperArm(upperArm, direction, normal, lift);
    const moved = angleBetween(upperArm, before) * upper;
    const left = Math.max(SPEED * seconds - moved, LEAST_SPEED * seconds);
    this.swing(direction, up, r, lift, seconds, left);
    this.lift = lift;
    let turn = shoulder.turn(direction, normal, lift);
    if (turn === null) {
      // no turn helps: more bend of the elbow may, and where it does not, a hand that is nearer
      const away = shoulder.away(direction) + CLEAR;
      if (away > this.greatestLift(r)) r = this.nearer(r, away);
      lift = Math.min(Math.max(lift, away), this.greatestLift(r));
      turn = shoulder.turn(direction, normal, lift);
      this.turnBy(direction, turn ?? 0);
    } else if (turn !== 0) {
      this.turnBy(direction, turn);
    }
    this.toUpperArm(upperArm, direction, normal, lift);
    const most = (moved + left) / upper;
    hanging.normal.set(normal);
    if (this.shown && (turn === null || angleBetween(upperArm, this.was) > most)) {
      // the shoulder's limit leaves one way only, and it is a long one: the hand waits for the elbow; where it leaves none,
      // close to the shoulder, the elbow waits too
      if (turn !== null) shoulder.toward(this.was, this.was, upperArm, most);
      for (let i = 0; i < 3; i++) wanted[i] = direction[i] * reach;
      this.reachOut(this.was, wanted);
    } else {
      this.was.set(upperArm);
      for (let i = 0; i < 3; i++) hanging.tip[i] = direction[i] * r;
      hanging.bend = this.bendOf(r, lift);
    }
    this.shown = true;
    return hanging;
  }

  private makeSquare(normal: Numbers, direction: Numbers): void {
    squareTo(this.normal, 0, normal, 0, direction, 0);
    if (!unit(this.normal, 0, this.normal, 0)) across(this.normal, 0, direction, 0);
  }

  /** The unit vector (3) from the shoulder to the elbow. */
  private toUpperArm(out: Numbers, direction: Numbers, normal: Numbers, lift: number): void {
    cross(this.side, 0, direction, 0, normal, 0);
    combine(out, 0, direction, 0, Math.cos(lift), this.side, 0, Math.sin(lift));
  }

  /** Swings the normal about the chord towards the vertical plane's by as much as the elbow may move. */
  private swing(direction: Numbers, up: Numbers, r: number, lift: number, seconds: number, left: number): void {
    const { normal, wanted, side } = this;
    if (!verticalNormal(wanted, direction, up)) return;
    squareTo(side, 0, direction, 0, up, 0);
    const off = length(side, 0) * r;
    const pull = (off * off) / (off * off + NEAR_AXIS * NEAR_AXIS);
    cross(side, 0, normal, 0, wanted, 0);
    const swing = Math.atan2(dot(side, 0, direction, 0), dot(normal, 0, wanted, 0));
    const most = Math.min(FASTEST * seconds, left / Math.max(this.arm.proportions.upper * Math.sin(lift), 1e-3));
    this.turnBy(direction, within(-most, swing * (1 - 2 ** ((-seconds * pull) / HALF_LIFE)), most));
  }

  private turnBy(direction: Numbers, turn: number): void {
    const { normal, side } = this;
    cross(side, 0, direction, 0, normal, 0);
    combine(normal, 0, normal, 0, Math.cos(turn), side, 0, Math.sin(turn));
    unit(normal, 0, normal, 0);
  }

  /** What hangs, where forearm and hand come nearest to `target` from an upper arm that is on its way. */
  private reachOut(upperArm: Numbers, target: Numbers): void {
    const { upper, fore, hand } = this.arm.proportions;
    const { hanging, side, along, before: way, wanted: direction } = this;
    const { tip, normal } = hanging;
    addScaled(way, 0, target, 0, upperArm, 0, -upper);
    const shortest = Math.sqrt(fore * fore + hand * hand + 2 * fore * hand * Math.cos(WRIST_LIMIT));
    const reach = within(shortest, length(way, 0), fore + hand);
    // where forearm and hand are straight, the cosine has lost the digits that tell the bend
    const bend = reach < fore + hand ? acos((reach * reach - fore * fore - hand * hand) / (2 * fore * hand)) : 0;
    const lean = Math.atan2(hand * Math.sin(bend), fore + hand * Math.cos(bend));
    squareTo(side, 0, way, 0, upperArm, 0);
    if (!unit(side, 0, side, 0)) cross(side, 0, normal, 0, upperArm, 0);
    let angle = Math.atan2(dot(way, 0, side, 0), dot(way, 0, upperArm, 0));
    angle = within(lean, angle, Math.min(ELBOW_LIMIT + lean, Math.PI));
    combine(along, 0, upperArm, 0, Math.cos(angle), side, 0, Math.sin(angle));
    combine(tip, 0, upperArm, 0, upper, along, 0, reach);
    const r = Math.min(length(tip, 0), OUTER_RADIUS);
    if (!unit(direction, 0, tip, 0)) direction.set(upperArm);
    squareTo(side, 0, upperArm, 0, direction, 0);
    if (!unit(side, 0, side, 0)) cross(side, 0, direction, 0, normal, 0);
    cross(normal, 0, side, 0, direction, 0);
    for (let i = 0; i < 3; i++) tip[i] = direction[i] * r;
    this.arm.limits(this.limits, 0, r);
    hanging.bend = within(this.limits[0], bend, this.limits[1]);
  }

  /** The farthest tip, no farther than `r`, whose upper arm is lifted `away` radians off the chord. */
  private nearer(r: number, away: number): number {
    let near = this.arm.inner, far = r;
    for (let i = 0; i < 40; i++) {
      const middle = 0.5 * (near + far);
      if (this.greatestLift(middle) >= away) near = middle;
      else far = middle;
    }
    return near;
  }

  /** The least lift that reaches `r` with elbow and wrist within their limits. */
  private leastLift(r: number): number {
    this.arm.limits(this.limits, 0, r);
    return this.liftOf(r, this.limits[1]);
  }

  /** The greatest. */
  private greatestLift(r: number): number {
    this.arm.limits(this.limits, 0, r);
    return this.liftOf(r, this.limits[0]);
  }

  private liftOf(r: number, bend: number): number {
    const { upper, fore, hand } = this.arm.proportions;
    const square = fore * fore + hand * hand + 2 * fore * hand * Math.cos(bend);
    return acos((upper * upper + r * r - square) / (2 * upper * r));
  }

  private bendOf(r: number, lift: number): number {
    const { upper, fore, hand } = this.arm.proportions;
    // at a limit the cosine has lost the digits that tell the bend
    if (lift >= this.greatestLift(r)) return this.limits[0];
    const square = upper * upper + r * r - 2 * upper * r * Math.cos(lift);
    return within(this.limits[0], acos((square - fore * fore - hand * hand) / (2 * fore * hand)), this.limits[1]);
  }
}
