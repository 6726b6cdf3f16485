/** The leg (paper 4): the thigh is lifted by an angle (radians) from straight down, the shank hangs, the ankle is fixed. */

import { MAX_THIGH_ANGLE_RAD, MIN_THIGH_ANGLE_RAD } from "./constants";

/** The nearest angle a thigh is pulled to. */
export function clampThigh(theta: number): number {
  return Math.min(Math.max(theta, MIN_THIGH_ANGLE_RAD), MAX_THIGH_ANGLE_RAD);
}

/** How far the knee bends so that the shank hangs; a thigh pulled back keeps it straight, as knees bend one way. */
export function kneeBend(theta: number): number {
  return Math.max(0, theta);
}
