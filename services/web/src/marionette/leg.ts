/**
 * The leg (paper 4): the thigh is lifted by an angle (radians, from straight down), the shank hangs, the ankle is
 * fixed.
 */

import { MAX_THIGH_ANGLE_RAD, MIN_THIGH_ANGLE_RAD } from "./constants";

/** Return the nearest angle within the limits of a thigh. */
export function clampThigh(theta: number): number {
  return Math.min(Math.max(theta, MIN_THIGH_ANGLE_RAD), MAX_THIGH_ANGLE_RAD);
}

/** Return the bend of the knee with which the shank hangs; 0 for a thigh behind the vertical. */
export function kneeBend(theta: number): number {
  return Math.max(0, theta);
}
