/** What a puppeteer's own limbs are solved with: the marionette's inverse kinematics for one figure. */

import type { Figure, Pose } from "../motion/skeleton";

/** Targets are as in the contract's Input: the hand tip in the shoulder's frame in arm lengths; of a leg the thigh's angle, first. */
export interface Solver {
  /** Where `limb` is in `pose`, written into `out` (3). */
  target(pose: Pose, limb: number, out: Float64Array): void;

  /**
   * Turns the three joints of `limb` in `pose` so that it is at `target` (3). `weight`, 0..1, is how far they go from the pose's
   * way of being there to the marionette's; `nowMs` is local time, for what has memory.
   */
  solve(pose: Pose, limb: number, target: Float64Array, weight: number, nowMs: number): void;

  /** `limb` is let go: forget what is remembered of it. */
  rest(limb: number): void;
}

/** Makes the solver of a figure; what it needs may have to be fetched first, from the HTTP `origin` of the stream. */
export type SolverOf = (figure: Figure, origin: string) => Solver | Promise<Solver>;
