/**
 * From one account of a limb to another without a step: when what is shown changes over, the difference of the joints at that
 * instant stays laid over the new and is let in over `SECONDS` (inertialization: Bollo, GDC 2018, with a decay of our own).
 */

import { conjugate, multiply, type Numbers, slerp } from "../motion/rotation";
import { normalise } from "../motion/vector";
import { minimumJerk } from "./handover";

/** Seconds in which a difference is let in. */
export const CORRECTION_S = 0.3;

const IDENTITY = Float64Array.of(1, 0, 0, 0);

/** The three joints of one limb: twelve numbers. */
export class Correction {
  /** Of each joint the turn that is left at `passed` 0. */
  private readonly differences = new Float64Array(12);
  private elapsedS = CORRECTION_S;
  private readonly turn = new Float64Array(4);

  /** Whether there is anything left of it. */
  get isActive(): boolean {
    return this.elapsedS < CORRECTION_S;
  }

  /** What was shown as `from` (12 at `fromAt`, and what is left of this over it) is `to` (12 at `toAt`) from now on. */
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

  /** `seconds` later. */
  advance(seconds: number): void {
    this.elapsedS = Math.min(this.elapsedS + seconds, CORRECTION_S);
  }

  /** Lays what is left over the joints (12). */
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
