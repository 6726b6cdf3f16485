/**
 * Limbs of a figure: from a target to the local rotations of three joints, and back. A hand's target is its tip in the
 * shoulder's frame (axes of vl5), in arm lengths; a leg's is the thigh's angle from straight down in the vertical plane
 * the hips face. Gravity is the world's. As `marionette/limbs.py`, without allocation once made.
 */

import { conjugate, multiply, rotate, type Numbers } from "../motion/rotation";
import type { Figure } from "../motion/skeleton";
import { Arm } from "./arm";
import { clampThigh, kneeBend } from "./leg";
import { verticalNormal } from "./plane";
import { WRIST_LIMIT, proportionsOf, type Proportions } from "./proportions";
import { aboutAxis, across, cross, dot, fromColumns, length, normalise, put, squareTo, unit } from "../motion/vector";

const SACROILIAC = 1;
const VL5 = 10;
const FIRST_JOINT = [12, 15, 2, 6] as const;
const X = Float64Array.of(1, 0, 0);
const UP = Float64Array.of(0, 1, 0);
const FORWARDS = Float64Array.of(0, 0, 1);
/** At rest, turning about this lifts an elbow's or a thigh's lower end forwards. */
const BEND_AXIS = Float64Array.of(-1, 0, 0);

/** Orientation (4) with x along `link` and z as near to the axis of the bend as square to it allows. */
function linkFrame(out: Numbers, outAt: number, link: Numbers, linkAt: number): void {
  const columns = new Float64Array(9);
  if (!unit(columns, 0, link, linkAt)) put(columns, 0, 0, -1, 0);
  squareTo(columns, 6, BEND_AXIS, 0, columns, 0);
  if (!unit(columns, 6, columns, 6)) across(columns, 6, columns, 0);
  cross(columns, 3, columns, 6, columns, 0);
  fromColumns(out, outAt, columns, 0);
}

/** The links (9) of an arm at rest: upper arm, forearm, hand. */
function armLinks(figure: Figure, limb: 0 | 1): Float64Array {
  const shoulder = FIRST_JOINT[limb];
  const links = new Float64Array(9);
  links.set(figure.offsets.subarray(3 * shoulder + 3, 3 * shoulder + 9), 0);
  links.set(figure.tips.subarray(3 * shoulder + 6, 3 * shoulder + 9), 6);
  return links;
}

/** The proportions of a figure's arm (limb 0 or 1): their identity names the table to fetch. */
export function armProportions(figure: Figure, limb: 0 | 1): Proportions {
  const links = armLinks(figure, limb);
  return proportionsOf(length(links, 0), length(links, 3), length(links, 6));
}

/** One arm of a figure. */
export class ArmRig {
  /** Index of the shoulder; elbow and wrist follow it. */
  readonly shoulder: number;
  /** The arm's length in metres. */
  readonly scale: number;
  readonly arm: Arm;
  private readonly links: Float64Array;
  private readonly frames = new Float64Array(12);
  private readonly palmDown: number;
  private readonly angles = new Float64Array(3);
  private readonly columns = new Float64Array(9);
  private readonly turn = new Float64Array(4);
  private readonly palm = new Float64Array(4);
  private readonly place = new Float64Array(3);

  /** `limb` is 0 (left hand) or 1 (right hand), `table` what `readTable` gave for `armProportions(figure, limb)`. */
  constructor(figure: Figure, limb: 0 | 1, table: Float64Array) {
    this.shoulder = FIRST_JOINT[limb];
    this.links = armLinks(figure, limb);
    this.scale = length(this.links, 0) + length(this.links, 3) + length(this.links, 6);
    this.arm = new Arm(armProportions(figure, limb), table);
    for (let link = 0; link < 3; link++) linkFrame(this.frames, 4 * link, this.links, 3 * link);
    this.palmDown = limb === 0 ? Math.PI / 2 : -Math.PI / 2;
  }

  /** The world's up (3) in the shoulder's frame, for a pose's 18 rotations. */
  up(out: Numbers, outAt: number, rotations: Numbers): void {
    multiply(this.turn, 0, rotations, 0, rotations, 4 * VL5);
    conjugate(this.turn, 0, this.turn, 0);
    rotate(out, outAt, this.turn, 0, UP, 0);
  }

  /** Where the pose has the hand tip (3): the target that asks for this place. */
  target(out: Numbers, outAt: number, rotations: Numbers): void {
    const { turn, place, links } = this;
    let x = 0, y = 0, z = 0;
    for (let link = 0; link < 3; link++) {
      const at = 4 * (this.shoulder + link);
      if (link === 0) for (let i = 0; i < 4; i++) turn[i] = rotations[at + i];
      else multiply(turn, 0, turn, 0, rotations, at);
      rotate(place, 0, turn, 0, links, 3 * link);
      x += place[0];
      y += place[1];
      z += place[2];
    }
    put(out, outAt, x / this.scale, y / this.scale, z / this.scale);
  }

  /** The unit vector (3) to a target; straight down for the shoulder itself. */
  direction(out: Numbers, outAt: number, target: Numbers, targetAt: number): void {
    if (!unit(out, outAt, target, targetAt)) put(out, outAt, 0, -1, 0);
  }

  /** The normal (3) of the vertical plane through a target; on the axis of the one that faces forwards. */
  restingNormal(out: Numbers, outAt: number, target: Numbers, targetAt: number, up: Numbers, upAt: number): void {
    const { place } = this;
    this.direction(place, 0, target, targetAt);
    if (verticalNormal(out, outAt, place, 0, up, upAt)) return;
    squareTo(out, outAt, FORWARDS, 0, up, upAt);
    if (!unit(out, outAt, out, outAt)) out.set(UP, outAt);
    cross(out, outAt, out, outAt, up, upAt);
    squareTo(out, outAt, out, outAt, place, 0);
    if (!unit(out, outAt, out, outAt)) across(out, outAt, place, 0);
  }

  /**
   * Rotations of shoulder, elbow and wrist (12) that bring the tip to `target` in the plane of `normal`. `up` is the
   * world's; `normal` is a unit vector square to the target, from `restingNormal` or a `Plane`.
   */
  hang(
    out: Numbers, outAt: number, target: Numbers, targetAt: number, up: Numbers, upAt: number,
    normal: Numbers, normalAt: number,
  ): void {
    const { columns, frames, angles, turn, palm, place } = this;
    this.direction(columns, 0, target, targetAt);
    squareTo(place, 0, columns, 0, up, upAt);
    const beta = Math.atan2(dot(columns, 0, up, upAt), length(place, 0));
    this.arm.angles(angles, 0, this.arm.clamp(length(target, targetAt)), beta);
    columns.set(normal.subarray(normalAt, normalAt + 3), 6);
    cross(columns, 3, columns, 6, columns, 0);
    // the more the wrist bends, the more the palm turns down: to the side a wrist bends little
    const share = (angles[2] - angles[1]) / WRIST_LIMIT;
    aboutAxis(palm, 0, 0, this.palmDown * share * share * (3 - 2 * share));
    const shoulder = outAt, elbow = outAt + 4, wrist = outAt + 8;
    fromColumns(out, shoulder, columns, 0);
    aboutAxis(turn, 0, 2, angles[0] - beta);
    multiply(out, shoulder, out, shoulder, turn, 0);
    conjugate(turn, 0, frames, 0);
    multiply(out, shoulder, out, shoulder, turn, 0);
    aboutAxis(turn, 0, 2, angles[1] - angles[0]);
    multiply(out, elbow, frames, 0, turn, 0);
    multiply(out, elbow, out, elbow, palm, 0);
    conjugate(turn, 0, frames, 4);
    multiply(out, elbow, out, elbow, turn, 0);
    conjugate(turn, 0, palm, 0);
    multiply(out, wrist, frames, 4, turn, 0);
    aboutAxis(turn, 0, 2, angles[2] - angles[1]);
    multiply(out, wrist, out, wrist, turn, 0);
    multiply(out, wrist, out, wrist, palm, 0);
    conjugate(turn, 0, frames, 8);
    multiply(out, wrist, out, wrist, turn, 0);
    normalise(out, shoulder);
    normalise(out, elbow);
    normalise(out, wrist);
  }
}

/** One leg of a figure. */
export class LegRig {
  /** Index of the hip; knee and ankle follow it. */
  readonly hip: number;
  private readonly thigh: Float64Array;
  private readonly thighFrame = new Float64Array(4);
  private readonly shankFrame = new Float64Array(4);
  private readonly ankle = new Float64Array(4);
  private readonly hips = new Float64Array(4);
  private readonly columns = new Float64Array(9);
  private readonly turn = new Float64Array(4);
  private readonly place = new Float64Array(3);

  /** `limb` is 2 (left leg) or 3 (right leg). */
  constructor(figure: Figure, limb: 2 | 3) {
    this.hip = FIRST_JOINT[limb];
    this.thigh = figure.offsets.slice(3 * this.hip + 3, 3 * this.hip + 6);
    linkFrame(this.thighFrame, 0, this.thigh, 0);
    linkFrame(this.shankFrame, 0, figure.offsets, 3 * this.hip + 6);
    // the foot is level when the shank hangs plumb: fixed to the shank as standing has it
    fromColumns(this.turn, 0, Float64Array.of(0, -1, 0, 0, 0, 1, -1, 0, 0), 0);
    conjugate(this.turn, 0, this.turn, 0);
    multiply(this.ankle, 0, this.shankFrame, 0, this.turn, 0);
    normalise(this.ankle, 0);
  }

  /** The hips' world orientation into `hips`; into `columns` the level direction they face, up, and their product. */
  private face(rotations: Numbers): void {
    const { hips, columns, place } = this;
    multiply(hips, 0, rotations, 0, rotations, 4 * SACROILIAC);
    rotate(place, 0, hips, 0, X, 0);
    cross(columns, 0, place, 0, UP, 0);
    rotate(place, 0, hips, 0, FORWARDS, 0);
    put(columns, 0, columns[0] + 0.05 * place[0], 0, columns[2] + 0.05 * place[2]);
    if (!unit(columns, 0, columns, 0)) columns.set(FORWARDS, 0);
    columns.set(UP, 3);
    cross(columns, 6, columns, 0, UP, 0);
  }

  /** The thigh's angle in a pose (18 rotations), within its limits. */
  angle(rotations: Numbers): number {
    this.face(rotations);
    multiply(this.turn, 0, this.hips, 0, rotations, 4 * this.hip);
    rotate(this.place, 0, this.turn, 0, this.thigh, 0);
    return clampThigh(Math.atan2(dot(this.place, 0, this.columns, 0), -this.place[1]));
  }

  /** Rotations of hip, knee and ankle (12) with the thigh at `theta` radians and the shank hanging. */
  hang(out: Numbers, outAt: number, theta: number, rotations: Numbers): void {
    const { turn } = this;
    this.face(rotations);
    const lifted = clampThigh(theta);
    fromColumns(out, outAt, this.columns, 0);
    conjugate(turn, 0, this.hips, 0);
    multiply(out, outAt, turn, 0, out, outAt);
    aboutAxis(turn, 0, 2, lifted - Math.PI / 2);
    multiply(out, outAt, out, outAt, turn, 0);
    conjugate(turn, 0, this.thighFrame, 0);
    multiply(out, outAt, out, outAt, turn, 0);
    aboutAxis(turn, 0, 2, -kneeBend(lifted));
    multiply(out, outAt + 4, this.thighFrame, 0, turn, 0);
    conjugate(turn, 0, this.shankFrame, 0);
    multiply(out, outAt + 4, out, outAt + 4, turn, 0);
    normalise(out, outAt);
    normalise(out, outAt + 4);
    out.set(this.ankle, outAt + 8);
  }
}
