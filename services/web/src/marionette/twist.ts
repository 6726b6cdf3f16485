/**
 * Limit of the speed at which the bones of an arm turn about their own axes. The position of a bone does not
 * determine its twist: an arm that is almost straight may lie in any plane, and a wrist that bends a little more
 * may turn the palm over. So each bone has a shown twist that lags behind fast changes. Shoulder, elbow and wrist
 * trade the difference, and no joint moves. Python: `marionette/twist_step.py`.
 */

import { conjugate, multiply, type Numbers, rotate } from "../motion/rotation";
import { dot, fromAxisAngle, normalise, rotationBetween, setVector, unit } from "../motion/vector";
import { MAX_TWIST_LAG_RAD, MAX_TWIST_SPEED_RAD_S } from "./constants";

/** One full turn. */
export const FULL_TURN_RAD = 2 * Math.PI;

/** Twist of the three bones of one arm. */
export class TwistLimiter {
  /** Twist (3) of each shown bone relative to the requested one, within `MAX_TWIST_LAG_RAD` either way. */
  readonly lagRad = new Float64Array(3);
  private hasOrientations = false;
  private readonly directions = new Float64Array(9);
  private readonly orientations = new Float64Array(12);
  private readonly requested = new Float64Array(4);
  private readonly carried = new Float64Array(4);
  private readonly turn = new Float64Array(4);
  private readonly along = new Float64Array(3);
  private readonly before = new Float64Array(3);

  /** `links` (9) are the bones at rest, of any length. */
  constructor(links: Numbers) {
    for (let at = 0; at < 9; at += 3)
      if (!unit(this.directions, at, links, at)) setVector(this.directions, at, 0, -1, 0);
  }

  /** Forget the state. */
  reset(): void {
    this.hasOrientations = false;
    this.lagRad.fill(0);
  }

  /**
   * Change joints (12) to the shown ones, `seconds` after the last call. Joint positions stay, and no bone's twist
   * changes by more than `share` (0..1) of `MAX_TWIST_LAG_RAD`. The joints stay unchanged at the first call and
   * whenever no bone lags.
   */
  limit(joints: Numbers, at: number, share: number, seconds: number): void {
    const { requested, orientations: shown, lagRad: lag, turn } = this;
    requested[0] = 1;
    setVector(requested, 1, 0, 0, 0);
    for (let link = 0; link < 3; link++) {
      multiply(requested, 0, requested, 0, joints, at + 4 * link);
      if (this.hasOrientations) this.limitBoneTwist(link, MAX_TWIST_LAG_RAD * share, MAX_TWIST_SPEED_RAD_S * seconds);
      else for (let i = 0; i < 4; i++) shown[4 * link + i] = requested[i];
    }
    this.hasOrientations = true;
    if (lag[0] === 0 && lag[1] === 0 && lag[2] === 0) return;
    for (let i = 0; i < 4; i++) joints[at + i] = shown[i];
    for (let i = 4; i < 12; i += 4) {
      conjugate(turn, 0, shown, i - 4);
      multiply(joints, at + i, turn, 0, shown, i);
      normalise(joints, at + i);
    }
  }

  /** Limit the lag of one bone to `maxLag` radians, and reduce it by up to `maxStep` radians. */
  private limitBoneTwist(link: number, maxLag: number, maxStep: number): void {
    const { directions, requested, orientations: shown, lagRad: lag, carried, turn, along, before } = this;
    rotate(along, 0, requested, 0, directions, 3 * link);
    rotate(before, 0, shown, 4 * link, directions, 3 * link);
    rotationBetween(carried, 0, before, 0, along, 0);
    multiply(carried, 0, carried, 0, shown, 4 * link);
    conjugate(turn, 0, requested, 0);
    multiply(turn, 0, carried, 0, turn, 0);
    let angle = 2 * Math.atan2(dot(turn, 1, along, 0), turn[0]);
    // keep the way round unless it is much longer by now
    angle += FULL_TURN_RAD * Math.round((lag[link] - angle) / FULL_TURN_RAD);
    if (Math.abs(angle) > MAX_TWIST_LAG_RAD) angle -= FULL_TURN_RAD * Math.round(angle / FULL_TURN_RAD);
    const left = Math.min(Math.max(Math.abs(angle) - maxStep, 0), maxLag);
    lag[link] = left > 0 ? Math.sign(angle) * left : 0;
    fromAxisAngle(turn, 0, along, 0, lag[link]);
    multiply(shown, 4 * link, turn, 0, requested, 0);
    normalise(shown, 4 * link);
  }
}
