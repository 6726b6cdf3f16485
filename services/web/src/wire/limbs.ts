/** Limbs by number (`proto/SPEC.md`, 1.4): limb l of performer k is 4 k + l. */

import { LIMBS } from "../motion/skeleton";

/** Performers of a motion, one per track of type `motion`. */
export const MAX_PERFORMERS = 4;
/** Props of a session. */
export const MAX_PROPS = 8;
export const MAX_LIMBS = LIMBS.length * MAX_PERFORMERS;

/** Returns the number of a performer's limb; `limb` is an index into `LIMBS`. */
export function limbNumber(performer: number, limb: number): number {
  return performer * LIMBS.length + limb;
}

/** Returns the index of the performer that the limb of this number belongs to. */
export function performerOfLimb(number: number): number {
  return Math.floor(number / LIMBS.length);
}

/** Returns the index into `LIMBS` of the limb of this number. */
export function limbWithinPerformer(number: number): number {
  return number % LIMBS.length;
}

/** Returns whether the limb of this number is a hand. */
export function isHand(number: number): boolean {
  return limbWithinPerformer(number) < 2;
}

/** Id under which the crowd holds a limb (proto/server.md, 6.3). */
export const CROWD = "crowd";
