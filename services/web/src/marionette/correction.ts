/**
 * Transition between two sources of a limb without a step: the difference of the joints at the change decays over
 * `CORRECTION_S` (inertialization: Bollo, GDC 2018, with a decay of our own design).
 */

import { conjugate, multiply, type Numbers, slerp } from "../motion/rotation";
import { normalise } from "../motion/vector";
import { minimumJerk } from "./handover";

/** Duration of the decay. */
export const CORRECTION_S = 0.3;

const IDENTITY = Float64Array.of(1, 0, 0, 0);

/** Correction of the three joints of one limb: twelve numbers. */
export class Correction {
  /** Difference of each joint at the begin. */
  private readonly differences = new Float64Array(12);
  private elapsedS = CORRECTION_S;
  private readonly turn = new Float64Array(4);

  /** True if a difference is left. */
  get isActive(): boolean {
    return this.elapsedS < CORRECTION_S;
  }

  /** Begin a transition from the shown joints `from` (12), including a running correction, to `to` (12). */
  begin(from: Numbers, fromAt: number, to: Numbers, toAt: number): void {
    const { differences, turn } = this;
    for (let at = 0; at < 12; at += 4) {
      this.computeRemaining(at);
      multiply(differences, at, turn, 0, from, fromAt + at);
      conjugate(turn, 0, to, toAt + at);
      multiply(differences, at, differences, at, turn, 0);
      normalise(differences, at);
    }
    this.elapsedS = 0;
  }

  /** Advance by `seconds`. */
  advance(seconds: number): void {
    this.elapsedS = Math.min(this.elapsedS + seconds, CORRECTION_S);
  }

  /** Apply the remaining difference to the joints (12). */
  apply(joints: Numbers, at: number): void {
    if (!this.isActive) return;
    for (let joint = 0; joint < 12; joint += 4) {
      this.computeRemaining(joint);
      multiply(joints, at + joint, this.turn, 0, joints, at + joint);
      normalise(joints, at + joint);
    }
  }

  private computeRemaining(at: number): void {
    if (!this.isActive) this.turn.set(IDENTITY);
    else slerp(this.turn, 0, this.differences, at, IDENTITY, 0, minimumJerk(this.elapsedS / CORRECTION_S));
  }
}
