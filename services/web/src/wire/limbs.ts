/** The limbs that are pulled, by number (`proto/SPEC.md`, Conventions): limb l of performer k is 4 k + l. */

import { LIMBS } from "../motion/skeleton";

/** Dancers of a motion, one for each of its first tracks `motion`. */
export const MAX_PERFORMERS = 4;
export const MAX_LIMBS = LIMBS.length * MAX_PERFORMERS;

/** The number of a performer's limb; `limb` counts as `LIMBS`. */
export function limbNumber(performer: number, limb: number): number {
  return performer * LIMBS.length + limb;
}

/** Whose the limb of this number is. */
export function performerOfLimb(number: number): number {
  return Math.floor(number / LIMBS.length);
}

/** Which limb of its performer it is, as in `LIMBS`. */
export function limbWithinPerformer(number: number): number {
  return number % LIMBS.length;
}
